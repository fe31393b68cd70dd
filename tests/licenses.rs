//! Every dependency has a licence that goes with MIT OR Apache-2.0: what `cargo deny check licenses` checks, without
//! it.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

use fmnet_tests::root;
use std::process::Command;

/// The same list as in `deny.toml`.
const ALLOWED: [&str; 13] = [
    "0BSD",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "ISC",
    "MIT",
    "MPL-2.0",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
];

/// Whether an SPDX expression allows the use: of alternatives one, of conjunctions all. `/` is an old way to write OR.
fn is_allowed(expression: &str) -> bool {
    let expression = expression.replace('/', " OR ");
    let expression = expression.trim();
    let parts = |operator: &str| split_outside(expression, operator);
    for (operator, all) in [(" OR ", false), (" AND ", true)] {
        let parts = parts(operator);
        if parts.len() > 1 {
            return if all {
                parts.iter().all(|p| is_allowed(p))
            } else {
                parts.iter().any(|p| is_allowed(p))
            };
        }
    }
    match expression.strip_prefix('(').and_then(|e| e.strip_suffix(')')) {
        Some(inner) => is_allowed(inner),
        None => ALLOWED.contains(&expression),
    }
}

/// Splits at an operator where no parenthesis is open.
fn split_outside<'a>(expression: &'a str, operator: &str) -> Vec<&'a str> {
    let (mut parts, mut start, mut depth) = (Vec::new(), 0, 0);
    for (at, c) in expression.char_indices() {
        depth += i32::from(c == '(') - i32::from(c == ')');
        if depth == 0 && at >= start && expression[at..].starts_with(operator) {
            parts.push(&expression[start..at]);
            start = at + operator.len();
        }
    }
    parts.push(&expression[start..]);
    parts
}

#[test]
fn expressions_are_understood() {
    for allowed in ["MIT", "MIT/GPL-3.0", "(MIT OR Apache-2.0) AND Unicode-3.0", "GPL-3.0 OR Zlib"] {
        assert!(is_allowed(allowed), "{allowed}");
    }
    for refused in ["GPL-3.0", "MIT AND GPL-3.0", "(GPL-3.0 OR LGPL-3.0) AND MIT", ""] {
        assert!(!is_allowed(refused), "{refused}");
    }
}

#[test]
fn every_dependency_may_be_used() {
    check("");
}

/// The Python package has a lock file of its own.
#[test]
fn every_dependency_of_the_python_package_may_be_used() {
    check("python");
}

/// The page, too.
#[test]
fn every_dependency_of_the_page_may_be_used() {
    check("web");
}

fn check(folder: &str) {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--all-features", "--locked"])
        .current_dir(root().join(folder))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let packages = metadata["packages"].as_array().unwrap();
    let refused: Vec<String> = packages
        .iter()
        .filter(|p| !p["license"].as_str().is_some_and(is_allowed))
        .map(|p| format!("{} {}: {} {}", p["name"], p["version"], p["license"], p["license_file"]))
        .collect();
    assert!(packages.len() > 100, "{} packages", packages.len());
    assert!(refused.is_empty(), "licences to look at:\n{}", refused.join("\n"));
}
