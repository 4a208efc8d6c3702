//! `servowire-wasm FOLDER FILE...`: writes the files, and 300 damaged ones, as `N.in` into a folder, with what is said of them
//! natively as `N.out`; the first line of each is the name.

use std::path::{Path, PathBuf};
use std::{env, fs, io, panic};

/// Damaged files.
const DAMAGED: usize = 300;

/// Numbers that look random and are the same each time.
struct Random(u64);

impl Random {
    fn below(&mut self, most: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        usize::try_from(self.0 % most.max(1) as u64).unwrap_or(0)
    }
}

fn damaged(sound: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = sound.to_vec();
    for _ in 0..=random.below(6) {
        let at = random.below(bytes.len());
        match random.below(5) {
            0 => bytes[at..].iter_mut().take(1).for_each(|byte| *byte = random.below(256).to_le_bytes()[0]),
            1 => bytes.insert(at, b"0 \n#,;$\xff"[random.below(8)]),
            2 if bytes.len() > 1 => drop(bytes.remove(at)),
            3 => {
                let piece = bytes[at..bytes.len().min(at + random.below(40))].to_vec();
                bytes.splice(at..at, piece);
            }
            _ if random.below(4) == 0 => bytes.truncate(at.max(1)),
            _ => {}
        }
    }
    bytes
}

fn write(folder: &Path, number: usize, name: &str, bytes: &[u8]) -> io::Result<()> {
    // The library for FST panics on some damaged files; on wasm32 that is a trap.
    let text = panic::catch_unwind(|| servowire_wasm::outputs(name, bytes)).unwrap_or_else(|_| "panic".to_owned());
    let with_name = |rest: &[u8]| [name.as_bytes(), b"\n", rest].concat();
    fs::write(folder.join(format!("{number}.in")), with_name(bytes))?;
    fs::write(folder.join(format!("{number}.out")), with_name(text.as_bytes()))
}

fn main() -> io::Result<()> {
    let mut arguments = env::args_os().skip(1).map(PathBuf::from);
    let folder = arguments.next().unwrap_or_default();
    let mut files = Vec::new();
    for path in arguments {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        files.push((name, fs::read(path)?));
    }
    panic::set_hook(Box::new(|_| ()));
    for (number, (name, bytes)) in files.iter().enumerate() {
        write(&folder, number, name, bytes)?;
    }
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    for number in files.len()..files.len() + DAMAGED {
        let (name, bytes) = &files[random.below(files.len())];
        write(&folder, number, name, &damaged(bytes, &mut random))?;
    }
    println!("{} captures, {DAMAGED} of them damaged", files.len() + DAMAGED);
    Ok(())
}
