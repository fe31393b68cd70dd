//! Changes of valid files: what damage, other programs and attackers do to them.

use rand::Rng;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;

/// Numbers at which counts, offsets and indices overflow or change sign.
const INTEGERS: [i64; 12] =
    [0, 1, -1, -2, 127, 255, 65535, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, i64::MAX, i64::MIN];
/// What may stand in a text where a number should.
const WORDS: [&str; 16] = [
    "0",
    "-1",
    "1",
    "2",
    "3",
    "4294967295",
    "4294967296",
    "-9223372036854775808",
    "18446744073709551615",
    "99999999999999999999",
    "1e308",
    "1e-320",
    "1e999",
    "nan",
    "-inf",
    "",
];
/// Structure sits at the ends of a large file, between them lie its numbers.
const ENDS: usize = 4096;

/// A file changed in one to eight places; `others` are what pieces may come from.
pub(super) fn mutated(seed: &[u8], others: &[Vec<u8>], rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..1 << rng.random_range(0..4) {
        change(&mut bytes, others, rng);
    }
    bytes
}

fn change(bytes: &mut Vec<u8>, others: &[Vec<u8>], rng: &mut ChaCha8Rng) {
    if bytes.is_empty() {
        bytes.push(rng.random());
        return;
    }
    let at = position(bytes.len(), rng);
    match rng.random_range(0..13) {
        0 => bytes[at] ^= 1 << rng.random_range(0..8),
        1 => bytes[at] = rng.random(),
        2 => bytes[at] = *[0, 0x20, 0x0a, 0x7f, 0x80, 0xff].choose(rng).unwrap(),
        3 => bytes[at] = rng.random_range(b'0'..=b'9'),
        4 => bytes.insert(at, rng.random()),
        5 => drop(bytes.remove(at)),
        6 => bytes.truncate(at),
        7 => overwrite(bytes, at, rng),
        8 => drop(bytes.drain(at..end_of_piece(at, bytes.len(), rng))),
        9 => {
            let piece = bytes[at..end_of_piece(at, bytes.len(), rng)].to_vec();
            insert(bytes, position(bytes.len(), rng), &piece);
        }
        10 => {
            let other = others.choose(rng).unwrap();
            let from = position(other.len().max(1), rng).min(other.len());
            bytes.truncate(at);
            bytes.extend(&other[from..]);
        }
        _ => replace_number(bytes, at, rng),
    }
}

fn position(length: usize, rng: &mut ChaCha8Rng) -> usize {
    if length <= 2 * ENDS || rng.random_range(0..5) == 0 {
        return rng.random_range(0..length);
    }
    let at = rng.random_range(0..2 * ENDS);
    if at < ENDS { at } else { length - (at - ENDS) - 1 }
}

fn end_of_piece(at: usize, length: usize, rng: &mut ChaCha8Rng) -> usize {
    (at + (1 << rng.random_range(0..8))).min(length)
}

fn insert(bytes: &mut Vec<u8>, at: usize, piece: &[u8]) {
    bytes.splice(at..at, piece.iter().copied());
}

/// Puts a binary number of two, four or eight bytes there, of either endianness.
fn overwrite(bytes: &mut [u8], at: usize, rng: &mut ChaCha8Rng) {
    let number = *INTEGERS.choose(rng).unwrap();
    let (little, big) = (number.to_le_bytes(), number.to_be_bytes());
    let size: usize = *[2, 4, 8].choose(rng).unwrap();
    let number = if rng.random() { &little[..size] } else { &big[8 - size..] };
    for (byte, &new) in bytes[at..].iter_mut().zip(number) {
        *byte = new;
    }
}

/// Replaces the word around a place, or the next one, by a number that hurts.
fn replace_number(bytes: &mut Vec<u8>, at: usize, rng: &mut ChaCha8Rng) {
    let is_part = |b: &u8| b.is_ascii_digit() || b"+-.eE".contains(b);
    let Some(start) = bytes[at..].iter().position(is_part).map(|i| at + i) else { return };
    let end = bytes[start..].iter().position(|b| !is_part(b)).map_or(bytes.len(), |i| start + i);
    let word = WORDS.choose(rng).unwrap();
    bytes.splice(start..end, word.bytes());
}
