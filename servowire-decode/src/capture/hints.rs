//! Names of file formats, and hints from the user about the files.

/// File formats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Value change dump.
    Vcd,
    /// A table of levels or voltages.
    Csv,
    /// A table of bytes from a Saleae Logic 2 analyser.
    AnalyzerTable,
    /// A waveform of a Tektronix oscilloscope.
    Isf,
    /// Saleae Logic 2 binary export.
    SaleaeBinary,
    /// A session of sigrok, PulseView or DSView.
    Session,
    /// FST.
    Fst,
    /// Text of sigrok-cli.
    SigrokText,
    /// A file of the OLS client.
    Ols,
    /// One sample in one or more whole bytes, one bit per channel.
    Raw,
    /// One channel, eight samples a byte, the oldest in bit 0.
    Packed,
    /// Bytes as hex digits.
    Hex,
    /// A table of messages, their bytes as hex digits.
    ByteTable,
    /// Binary records of one size.
    Records,
    /// Packets of a network capture.
    Pcapng,
}

impl Format {
    /// All formats, with their names on a command line (the one to show first) and a line of help.
    pub const ALL: [(Self, &'static [&'static str], &'static str); 15] = [
        (Self::Vcd, &["vcd"], "Value change dump (IEEE 1364)"),
        (Self::Csv, &["csv", "saleae-csv"], "A table of a logic analyser or an oscilloscope"),
        (Self::AnalyzerTable, &["analyzer-table"], "A table of bytes of an analyser of Saleae Logic 2"),
        (Self::Isf, &["isf"], "A waveform of a Tektronix oscilloscope (.isf)"),
        (Self::SaleaeBinary, &["saleae-binary"], "Saleae Logic 2 binary export"),
        (Self::Session, &["session"], "A session of sigrok, PulseView (.sr) or DSView (.dsl)"),
        (Self::Fst, &["fst"], "FST, as GTKWave and Verilator write it"),
        (Self::SigrokText, &["sigrok-text"], "Text of sigrok-cli -O bits or -O hex"),
        (Self::Ols, &["ols"], "A file of the OLS client, or of sigrok-cli -O ols"),
        (Self::Raw, &["raw"], "One sample in one or more whole bytes, one bit per channel (sigrok-cli -O binary)"),
        (Self::Packed, &["packed"], "One channel, eight samples a byte, the oldest in bit 0"),
        (Self::Hex, &["hex"], "Bytes as hex digits, one burst per line"),
        (Self::ByteTable, &["byte-table"], "A table of messages: columns data, time, direction"),
        (Self::Records, &["records"], "Binary records of one size (--record-size), one burst each"),
        (Self::Pcapng, &["pcapng", "pcap"], "Packets of a network capture, pcap or pcapng"),
    ];

    /// Text may be packed; the other formats are identified by their first bytes.
    pub(super) fn is_text(self) -> bool {
        matches!(
            self,
            Self::Vcd
                | Self::Csv
                | Self::AnalyzerTable
                | Self::Isf
                | Self::SigrokText
                | Self::Ols
                | Self::Hex
                | Self::ByteTable
        )
    }
}

/// Calls a function and returns even if it panics. If no guard is set, the function is called directly.
pub type Guard = fn(&mut dyn FnMut());

/// Hints from the user about the files.
#[derive(Debug, Clone, Copy, Default)]
pub struct Hints {
    /// The format; if unset, it is found from the content and the name.
    pub format: Option<Format>,
    /// Samples per second of a raw file.
    pub sample_rate: Option<u64>,
    /// Bytes per sample of a raw file; 1 if unset.
    pub unit_size: Option<usize>,
    /// Bytes of a record.
    pub record_size: Option<usize>,
    /// The voltage above which a column of a table is high; if unset, half-way between its levels.
    pub threshold: Option<f64>,
    /// The file is still growing: reading waits for its end.
    pub grows: bool,
    /// How to call the library for FST, which panics on some damaged files; by default it is called directly.
    pub guard: Option<Guard>,
}

impl Hints {
    /// Returns what to say of a hint that a format has no use for.
    pub(super) fn misplaced(&self, format: Format) -> Option<&'static str> {
        use Format::{Csv, Isf, Packed, Raw, Records};
        let said: [(bool, &[Format], _); 4] = [
            (
                self.sample_rate.is_some(),
                &[Raw, Packed, Csv],
                "--rate is for raw samples, and for tables without times",
            ),
            (self.unit_size.is_some(), &[Raw], "--unit-size is for raw samples: it needs --rate"),
            (self.record_size.is_some(), &[Records], "--record-size is for binary records"),
            (self.threshold.is_some(), &[Csv, Isf], "--threshold is for voltages, which only oscilloscopes record"),
        ];
        said.into_iter().find(|(is, of, _)| *is && !of.contains(&format)).map(|(.., what)| what)
    }
}
