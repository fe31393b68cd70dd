//! What the README says of speed is what `runtime/benches/compare.py` measured and wrote to the page of benchmarks.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

use fmnet_tests::root;

/// The words of a page, whatever its line breaks.
fn words(page: &str) -> String {
    let text = std::fs::read_to_string(root().join(page)).unwrap();
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn the_readme_has_the_sentence_of_the_benchmarks() {
    let page = words("docs/benchmarks.md");
    let (_, rest) = page.split_once("## In short ").expect("compare.py writes what is short");
    let sentence = rest.split(" ## ").next().unwrap();
    assert!(sentence.contains("6890 vertices take") && sentence.ends_with("GB."), "{sentence}");
    assert!(
        words("README.md").contains(sentence),
        "put this into README.md, section Accuracy and speed: {sentence}"
    );
}
