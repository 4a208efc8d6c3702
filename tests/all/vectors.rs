//! Every row of every vector file of the project passes.

use std::path::Path;

#[test]
fn all_vectors_pass() {
    let report = conformance::run_all(&Path::new(env!("CARGO_MANIFEST_DIR")).join("vectors"));
    for error in &report.errors {
        eprintln!("{error}");
    }
    for topic in &report.topics {
        println!("{topic}");
        for failure in &topic.failures {
            eprintln!("{failure}");
        }
    }
    assert!(report.passed());
}
