//! The table of CONTRIBUTING.

use crate::{hdsl, nikon, rtex, sorte, tformat};

const CONTRIBUTING: &str = include_str!("../../../../CONTRIBUTING.md");

macro_rules! rows {
    ($($act:literal: $row:ident;)+) => {
        [$(($act, [tformat::$row, nikon::$row, hdsl::$row, rtex::$row, sorte::$row])),+]
    };
}

fn table() -> String {
    let rows = rows! {
        "decode; `error.class()`, `class.name()`, `class.number()`": DECODE;
        "encode": ENCODE;
        "a code of the wire": CODE;
        "one exchange; `transmission()`, `hear(unit, end_ns)`, `poll(now_ns)`, `progress()`": EXCHANGE;
        "a procedure of several; `start(now_ns)`, `receive(outcome, ready_ns)`": PROCEDURE;
        "evidence, `evidence.at(now_ns, policy)`; `EvidenceCell`": FEEDBACK;
        "the other end; `hear`, `set_behaviour(Behaviour)`, `set_fault(Fault)`": DEVICE;
        "for tools: `inspect::inspect`; `error()`, `findings()`, `cause()`": INSPECT;
        "logs and files": LOG;
        "statistics": COUNTERS;
    };
    let mut text = String::from("| act | `tformat` | `nikon-aformat` | `hdsl` | `rtex-block` | `sorte-proto` |\n");
    text.push_str("|---|---|---|---|---|---|\n");
    for (act, cells) in rows {
        text += &["| ", act, " | ", &cells.join(" | "), " |\n"].concat();
    }
    text
}

#[test]
fn contributing_has_this_table() {
    let table = table();
    assert!(CONTRIBUTING.contains(&table), "put this table into CONTRIBUTING.md:\n{table}");
}
