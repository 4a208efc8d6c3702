//! What the example puts on the wire, against the arithmetic of its limits.
#![allow(clippy::unwrap_used, clippy::std_instead_of_core)]

use std::process::Command;

#[test]
fn axes_follow_their_plans_and_stop_on_the_way() {
    let run = Command::new(env!("CARGO_BIN_EXE_rtex-follow")).output().unwrap();
    let text = String::from_utf8(run.stdout).unwrap();
    assert!(run.status.success(), "{text}");
    // d / v + v / a + a / j = 0.5 + 0.2 + 0.05 s are 1,500 periods of 0.5 ms, and one to stay in the target; 400,000 units/s are
    // 200 a period, 2,000,000 units/s² half a unit more in each, which whole units make 0 to 2.
    let full = "in 1501 periods, at most 200 a period, 2 more or less in the next; on, motor 0 behind";
    // The short one never gets to its speed: d = v²/a + v a/j, so v = 270,156 units/s.
    let short = "in 1501 periods, at most 135 a period, 2 more or less in the next; on, motor 0 behind";
    // 300 periods on their way, 125 or less to slow down by one a period, 200 at rest.
    let want = [
        format!("axis 0:  200000 units {full}"),
        format!("axis 1:  -50000 units {short}"),
        format!("axis 0: -200000 units {full}"),
        format!("axis 1:   50000 units {short}"),
    ];
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.get(..4).unwrap(), want);
    let stopped = lines.get(4..).unwrap();
    assert_eq!(stopped.len(), 2, "{text}");
    for line in stopped {
        assert!(line.contains("2 more or less in the next; held: stopped by the caller, motor 0 behind"), "{line}");
    }
}
