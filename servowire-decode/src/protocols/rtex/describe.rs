//! Describes the fields of a block as they are shown.

use rtex_block::inspect::{self, Report};

use crate::event::{Field, Value};

/// Adds the code, then all fields that are not 0; with `zeros` also those that are.
pub(super) fn whole(report: &Report, block: &[u8], zeros: bool, fields: &mut Vec<Field>) {
    let (flags, others): (Vec<_>, Vec<_>) = report.fields().partition(is_flag);
    let shown = |field: &inspect::Field| {
        (zeros
            || !matches!(field.value, inspect::Value::Bit(false) | inspect::Value::Number(0) | inspect::Value::Hex(0)))
            && field.first != 0
    };
    let (codes, data): (Vec<_>, Vec<_>) = others.into_iter().filter(shown).partition(|field| field.first == 1);
    fields.extend(codes.iter().map(field));
    let name = if report.is_response() == Some(true) { "Status_Flags" } else { "Control_Bits" };
    fields.push(flag_field(&flags, block, name));
    fields.extend(data.iter().map(field));
}

/// Adds the code, and what has changed.
pub(super) fn changed(report: &Report, before: &Report, fields: &mut Vec<Field>) {
    let code = report.fields().find(|field| matches!(field.value, inspect::Value::Code(_)));
    fields.extend(code.as_ref().map(field));
    for inspect::Change { field: new, before: old } in report.changes(before) {
        if matches!(new.value, inspect::Value::Code(_)) {
            continue;
        }
        match (new.value, old) {
            (inspect::Value::Number(counter), Some(inspect::Value::Number(last))) if new.first == 0 => {
                if counter != (last + 1) % 4 {
                    fields.push(Field::text(new.name, format_args!("{last} -> {counter}: not the next")));
                }
            }
            _ => fields.push(field(&new)),
        }
    }
}

pub(super) fn notes(report: &Report, findings: Vec<String>, fields: &mut Vec<Field>) {
    let said = report.notes().map(|note| note.to_string());
    let strict = report.errors().map(|error| error.to_string());
    let cause = report.cause().map(|cause| cause.to_string());
    let text = findings.into_iter().chain(said).chain(strict).chain(cause).collect::<Vec<_>>().join("; ");
    if !text.is_empty() {
        fields.push(Field::text("note", text));
    }
}

fn is_flag(field: &inspect::Field) -> bool {
    matches!(field.first, 2 | 3)
}

/// Returns bytes 2-3 as one field.
fn flag_field(flags: &[inspect::Field], block: &[u8], name: &'static str) -> Field {
    let raw = block.get(2..4).map_or(0, |bytes| bytes.iter().rev().fold(0, |raw, &byte| raw << 8 | u64::from(byte)));
    let set = flags.iter().filter(|f| f.value == inspect::Value::Bit(true)).map(|f| f.name).collect();
    Field::new(name, Value::Flags { raw, digits: 4, set })
}

fn field(field: &inspect::Field) -> Field {
    match field.value {
        inspect::Value::Number(value) => Field::number(field.name, value),
        inspect::Value::Bit(bit) => Field::number(field.name, bit),
        inspect::Value::Hex(value) => Field::hex(field.name, value, if value > 0xff { 4 } else { 2 }),
        other => Field::text(field.name, other),
    }
}
