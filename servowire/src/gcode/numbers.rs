//! The numbers of a line that are not codes.

use super::AXES;
use super::words::Word;

/// The numbers of a line.
#[derive(Default)]
pub(super) struct Numbers {
    pub(super) axes: [Option<f64>; AXES],
    pub(super) center: [Option<f64>; AXES],
    pub(super) radius: Option<f64>,
    pub(super) feed: Option<f64>,
    pub(super) p: Option<f64>,
    /// Spindle and tool move no axis: S, T, H and D.
    others: [Option<f64>; 4],
}

impl Numbers {
    /// Returns whether there is X, Y or Z.
    pub(super) fn moves(&self) -> bool {
        self.axes.iter().any(Option::is_some)
    }

    /// Returns whether there are words of an arc.
    pub(super) fn bend(&self) -> bool {
        self.center.iter().any(Option::is_some) || self.radius.is_some()
    }

    pub(super) fn add(&mut self, word: Word) -> Result<(), String> {
        let place = match word.letter {
            'X' => &mut self.axes[0],
            'Y' => &mut self.axes[1],
            'Z' => &mut self.axes[2],
            'I' => &mut self.center[0],
            'J' => &mut self.center[1],
            'K' => &mut self.center[2],
            'R' => &mut self.radius,
            'F' => &mut self.feed,
            'P' => &mut self.p,
            'S' if word.value < 0.0 => return Err(format!("S{}: a number from 0 on", word.value)),
            'S' => &mut self.others[0],
            'T' => {
                word.whole()?;
                &mut self.others[1]
            }
            'H' => &mut self.others[2],
            'D' => &mut self.others[3],
            other => return Err(format!("{other} is not in the subset: X, Y, Z, I, J, K, R, F and P")),
        };
        match place.replace(word.value) {
            Some(_) => Err(format!("{} is there twice", word.letter)),
            None => Ok(()),
        }
    }
}
