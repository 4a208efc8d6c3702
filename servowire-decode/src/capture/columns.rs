//! The channels of a recording as plain vectors.

use super::recording::Line;
use crate::fault::Fault;
use crate::time::Time;

/// All changes of a channel.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Column {
    /// Its name.
    pub name: String,
    /// The times at which it takes a level; the first belongs to the level at the beginning.
    pub times: Vec<Time>,
    /// The level from that time onwards, one for each time.
    pub levels: Vec<bool>,
}

/// Reads a recording to its end.
pub fn columns(line: &mut dyn Line) -> Result<Vec<Column>, Fault> {
    let named = |name: &String| Column { name: name.clone(), ..Column::default() };
    let mut columns: Vec<Column> = line.channels().iter().map(named).collect();
    let mut changes = Vec::new();
    loop {
        let more = line.read(&mut changes)?;
        for change in changes.drain(..) {
            if let Some(column) = columns.get_mut(usize::from(change.channel)) {
                column.times.push(change.time);
                column.levels.push(change.level);
            }
        }
        if !more {
            return Ok(columns);
        }
    }
}
