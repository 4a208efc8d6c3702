//! The captures that come with the program are those of the generator, and show what was published.

#[path = "../../examples/render-captures.rs"]
#[allow(dead_code, reason = "its main is not needed here")]
mod render_captures;

use std::path::Path;

use crate::common;

use servowire_decode::protocols::CODECS;

#[test]
fn the_files_are_what_the_generator_makes() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let rendered = render_captures::render(&package.join("../tests/vectors/tformat/responses.jsonl")).unwrap();
    assert_eq!(rendered.len(), CODECS[0].captures.len());
    for (file, text) in rendered {
        let name = format!("captures/{file}");
        let (_, bundled) = CODECS[0].captures.iter().find(|(known, _)| *known == name).unwrap();
        assert!(text.as_bytes() == *bundled, "{name} is not what render-captures makes");
    }
}

#[test]
fn without_a_file_the_published_positions_are_shown() {
    let run = common::servowire(&["decode", "--json"]);
    run.is_good();
    let positions: Vec<i64> = run.json().iter().filter_map(|event| event["fields"]["ABS"].as_i64()).collect();
    let published = [
        3_915_817, 5_423_491, 8_249_791, 1_068_800, 5_349_452, 5_729_216, 17_950, 17_949, 17_948, 1_883_572, 7_907_664,
        7_267_713, 6_039_153, 3_755_428, 1_522_390, 229_187, 5_817_198, 1_721_302, 7_000_519, 4_358_403,
    ];
    assert_eq!(positions, published);
    let text = common::servowire(&["decode"]);
    text.is_good();
    assert!(text.out.contains("ABS 3915817  ENID 23  ABM 0  ALMC OF BE BA"), "{}", text.out);
}
