use super::*;
use std::vec::Vec;

pub(crate) const BOTH: [RunningDisparity; 2] = [RunningDisparity::Minus, RunningDisparity::Plus];

fn characters() -> Vec<Character> {
    let data = (0..=255).map(Character::data);
    data.chain(Control::ALL.into_iter().map(Character::control)).collect()
}

#[test]
fn every_character_in_both_columns_comes_back() {
    for character in characters() {
        for rd in BOTH {
            let coded = character.encode(rd);
            let (word, after) = (coded.word, coded.disparity);
            assert_eq!(word.decode(), Some(character));
            assert!(word.is_in(rd));
            assert!(matches!(word.disparity(), -2 | 0 | 2));
            assert_eq!(after == rd, word.disparity() == 0);
            assert_eq!(word.read(Rule::Strict).byte(), Ok(character.byte()));
        }
    }
}

/// Every word against a search through all encodings.
#[test]
fn decoding_equals_a_search() {
    let mut good = 0;
    for bits in 0..1024 {
        let word = Word::new(bits).unwrap();
        let found: Vec<_> = BOTH
            .into_iter()
            .flat_map(|rd| characters().into_iter().map(move |c| (rd, c)))
            .filter(|(rd, c)| c.encode(*rd).word == word)
            .collect();
        assert!(found.iter().all(|(_, c)| Some(*c) == word.decode()));
        assert_eq!(found.is_empty(), word.decode().is_none());
        assert_eq!(found.is_empty(), word.read(Rule::Strict).is_byte_error());
        for rd in BOTH {
            assert_eq!(found.iter().any(|(r, _)| *r == rd), word.is_in(rd));
        }
        good += u32::from(word.decode().is_some());
    }
    assert_eq!(good, 464);
    assert_eq!(Word::new(1024), None);
}

/// In a stream no more than five equal bits follow each other.
#[test]
fn run_length_is_at_most_five() {
    for first in characters() {
        for second in characters() {
            for rd in BOTH {
                let coded = first.encode(rd);
                let (a, rd) = (coded.word, coded.disparity);
                let b = second.encode(rd).word;
                let bits = u32::from(a.get()) | u32::from(b.get()) << 10;
                let mut run = (1, 0);
                for k in 1..20 {
                    run.0 = if bits >> k & 1 == bits >> (k - 1) & 1 { run.0 + 1 } else { 1 };
                    run.1 = run.1.max(run.0);
                }
                assert!(run.1 <= 5, "{bits:#022b}");
            }
        }
    }
}

/// Where the reduced rule sees no error it agrees with the tables about the value of data characters.
#[test]
fn the_reduced_rule_reads_every_data_character() {
    for byte in 0..=255 {
        for rd in BOTH {
            let reading = Character::data(byte).encode(rd).word.read(Rule::Reduced);
            assert_eq!((reading.raw(), reading.is_byte_error()), (byte, false));
        }
    }
    for control in Control::ALL {
        for rd in BOTH {
            let word = Character::control(control).encode(rd).word;
            let reading = word.read(Rule::Reduced);
            assert!(reading.is_special() && !reading.is_byte_error());
            assert_eq!(Rule::Reduced.table().entry(word).in_secondary(Rule::Reduced, word).raw(), control as u8);
        }
    }
}
