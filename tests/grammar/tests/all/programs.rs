//! The programs. Each macro pastes the same text for every crate that it is called for, and calls inherent methods: a function
//! that is generic over a trait would not see that their names differ. What is handed to it are values of the crate: a
//! context, bytes, settings. Each also says the cell of its row in the table of CONTRIBUTING.

/// Decodes a sound unit and refuses a damaged one with an error that has a class, a name, a number and a text.
macro_rules! decode {
    ($krate:ident::$unit:ident($($argument:ty),+); with ($($value:expr),*);
     sound $sound:expr; damaged $damaged:expr => $class:literal) => {
        pub(crate) const DECODE: &str =
            concat!("`", stringify!($unit), "::parse", stringify!(($($argument),+)), "`");

        #[test]
        fn decode() {
            assert!($krate::$unit::parse($($value,)* $sound).is_ok());
            let error: $krate::Error = $krate::$unit::parse($($value,)* $damaged).unwrap_err();
            let class: $krate::ErrorClass = error.class();
            assert_eq!(class.name(), $class);
            assert_eq!($krate::ErrorClass::from_number(class.number()), Some(class));
            let error: &dyn core::error::Error = &error;
            assert!(!error.to_string().is_empty());
        }
    };
}

/// Encodes a message to the other end.
macro_rules! encode {
    ($krate:ident $(:: $message:ident)+ = $value:expr) => {
        pub(crate) const ENCODE: &str = concat!("`", $(stringify!($message), "::",)+ "emit()`");

        #[test]
        fn encode() {
            let message: $krate $(:: $message)+ = $value;
            assert_eq!(message.emit(), message.emit());
            assert!(!message.to_string().is_empty());
        }
    };
}

/// A code of the wire becomes an enum and back.
macro_rules! code {
    ($krate:ident $(:: $code:ident)+: $known:expr; unknown $unknown:expr) => {
        pub(crate) const CODE: &str = concat!("`", $(stringify!($code), "::",)+ "from_code(code)`");

        #[test]
        fn code() {
            let known = <$krate $(:: $code)+>::from_code($known).unwrap();
            assert_eq!(known.code(), $known);
            assert_eq!(known.to_string(), known.name());
            assert!(<$krate $(:: $code)+>::ALL.contains(&known));
            assert_eq!(<$krate $(:: $code)+>::from_code($unknown), None);
        }
    };
}

/// One exchange by the clock: what to send, what was heard, how it ended.
macro_rules! exchange {
    ($krate:ident::$machine:ident::start($($name:ident = $value:expr),*); heard $unit:expr; $kind:literal, at $end_ns:expr) => {
        pub(crate) const EXCHANGE: &str =
            concat!(
                "`", stringify!($machine), "::start(", $(stringify!($name), ", ",)* "start_ns)`, `hear(", $kind, ", end_ns)`"
            );

        #[test]
        fn exchange() {
            use $krate::master::Progress;

            let mut machine = $krate::master::$machine::start($($value,)* 1_000);
            let sent = machine.transmission();
            assert!(sent.start_ns == 1_000 && sent.end_ns > sent.start_ns);
            assert!(matches!(machine.progress(), Progress::Pending { until_ns } if until_ns > sent.end_ns));
            let Progress::Done { value, ready_ns } = machine.hear($unit, $end_ns) else { panic!("no response") };
            assert!(ready_ns >= $end_ns);
            assert!(value.sampled_ns >= sent.start_ns && value.began_ns > value.sampled_ns && value.began_ns < $end_ns);

            let mut silent = $krate::master::$machine::start($($value,)* 1_000);
            let Progress::Failed { error, ready_ns } = silent.poll(10_000_000) else { panic!("it waits for ever") };
            assert_eq!(error.class().name(), "no_response");
            assert!(ready_ns < 10_000_000);

            let mut framing = $krate::master::$machine::start($($value,)* 1_000);
            let progress: Progress<_> = framing.framing_error($end_ns);
            assert!(!matches!(progress, Progress::Done { .. }));
        }
    };
}

/// A procedure of several exchanges, taken through them by the one loop there is.
macro_rules! procedure {
    ($krate:ident::$procedure:ident = $value:expr; lost $lost:expr) => {
        pub(crate) const PROCEDURE: &str = concat!("`", stringify!($procedure), "` by `servowire_core::run`");

        #[test]
        fn procedure() {
            let mut procedure: $krate::master::$procedure = $value;
            let mut sent = 0;
            let ended = servowire_core::run(&mut procedure, 1_000, |request: $krate::Request, not_before_ns| {
                assert!(!request.to_string().is_empty());
                sent += 1;
                let ready_ns = not_before_ns + 50_000;
                Ok::<_, Infallible>(servowire_core::Ended { outcome: Err($lost), ready_ns })
            });
            let Ok(ended) = ended;
            let error: $krate::Error = ended.outcome.unwrap_err();
            assert!(sent > 0 && ended.ready_ns >= 51_000, "{error}");
        }
    };
}

/// Of what can be deserialised there are two of these, and a call does not compile.
pub(crate) trait Unread<A> {
    fn is_never_read() {}
}

impl<T> Unread<()> for T {}

impl<T: serde::de::DeserializeOwned> Unread<u8> for T {}

/// Evidence is judged where it is used, and travels through a cell.
macro_rules! feedback {
    ($krate:ident: $evidence:expr, sampled at $sampled_ns:expr; $from:literal) => {
        pub(crate) const FEEDBACK: &str = $from;

        #[test]
        fn feedback() {
            use $krate::{Doubt, Evidence, Policy, Sample, Tolerated};

            let policy = Policy::new(125_000).tolerating(Tolerated::NOTHING);
            let evidence: Evidence = $evidence;
            let sample: Sample = evidence.at($sampled_ns + 125_000, policy).unwrap();
            assert_eq!(sample.sampled_ns(), $sampled_ns);
            let old: Doubt = evidence.at($sampled_ns + 125_001, policy).unwrap_err();
            assert_eq!(old, Doubt::Old { age_ns: 125_001 });
            assert_eq!(Evidence::NEVER.at($sampled_ns, policy), Err(Doubt::Never));
            let doubt: &dyn core::error::Error = &old;
            assert!(doubt.to_string().contains("125001 ns"));

            let mut cell = $krate::EvidenceCell::new();
            let (mut writer, mut reader) = cell.split();
            assert_eq!(reader.at($sampled_ns, policy), Err(Doubt::Never));
            writer.put(evidence);
            assert_eq!(reader.at($sampled_ns + 125_000, policy), Ok(sample));
            assert_eq!(reader.at($sampled_ns + 125_001, policy), Err(old));
            let strict = Policy::new(0);
            assert_eq!(reader.at($sampled_ns, strict), Ok(sample));
            assert_eq!(reader.at($sampled_ns + 1, strict), Err(Doubt::Old { age_ns: 1 }));

            // What a file holds is a message at best.
            <Evidence as crate::programs::Unread<_>>::is_never_read();
            <Sample as crate::programs::Unread<_>>::is_never_read();
        }
    };
}

/// The other end, with a decision that the documents leave open, and with a fault.
macro_rules! device {
    ($krate:ident::$device:literal = $value:expr; with $behaviour:expr; heard |$at:ident| ($($heard:expr),+); $hears:literal) => {
        pub(crate) const DEVICE: &str = concat!("`", $device, "`; `hear(", $hears, "`");

        #[test]
        fn device() {
            use $krate::device::{Behaviour, Fault};

            let mut device = $value;
            assert_eq!(Behaviour::new(), Behaviour::default());
            device.set_behaviour($behaviour);
            let answers = [Fault::None, Fault::Silent, Fault::None].into_iter().zip(1..).map(|(fault, ms)| {
                let $at = ms * 1_000_000_u64;
                device.set_fault(fault);
                device.hear($($heard),+).is_some()
            });
            assert!(answers.eq([true, false, true]));
        }
    };
}

/// For tools: what is wrong, and what the likely cause is.
macro_rules! inspect {
    ($krate:ident::inspect($($context:ident = $value:expr),*; $data:ident); damaged $damaged:expr => $class:literal) => {
        pub(crate) const INSPECT: &str =
            concat!("`inspect(", $(stringify!($value), ", ",)* stringify!($data), ")`");

        #[test]
        fn inspect() {
            use $krate::inspect::{Cause, Findings, Report};

            let damaged = $damaged;
            let report: Report = $krate::inspect::inspect($($value,)* damaged);
            let error: $krate::Error = report.error().unwrap();
            assert_eq!(error.class().name(), $class);
            let findings: Findings = report.findings();
            assert!(findings.contains(error.class()));
            let cause: Option<Cause> = report.cause();
            assert!(report.to_string().contains(&error.to_string()));
            if let Some(cause) = cause {
                assert!(report.to_string().contains(&cause.to_string()));
            }
            assert!(serde_json::to_string(&report).unwrap().starts_with('{'));
        }
    };
}

/// What goes into a log prints, on a host and over defmt; what is stored serialises.
macro_rules! log {
    ($krate:ident: $($type:ty),+ $(,)?) => {
        pub(crate) const LOG: &str = "`Display`, `defmt::Format`, serde";

        #[test]
        fn log() {
            fn logs<T: core::fmt::Display + defmt::Format + serde::Serialize>() {}
            fn is_error<T: core::error::Error>() {}
            logs::<$krate::Error>();
            logs::<$krate::ErrorClass>();
            logs::<$krate::Doubt>();
            logs::<$krate::Sample>();
            logs::<$krate::inspect::Cause>();
            logs::<$krate::inspect::Findings>();
            logs::<$krate::inspect::Report>();
            $(logs::<$type>();)+
            is_error::<$krate::Error>();
            is_error::<$krate::Doubt>();
        }
    };
}

/// Statistics over what was refused.
macro_rules! counters {
    ($krate:ident) => {
        pub(crate) const COUNTERS: &str = "`master::Counters`";

        #[test]
        fn counters() {
            let counters = $krate::master::Counters::default();
            assert!(counters.to_string().starts_with('0'));
            let again: $krate::master::Counters =
                serde_json::from_str(&serde_json::to_string(&counters).unwrap()).unwrap();
            assert_eq!(again, counters);
        }
    };
}

/// A row that is another one in this crate, with the reason.
macro_rules! differs {
    ($($row:ident: $cell:literal;)+) => {
        $(pub(crate) const $row: &str = $cell;)+
    };
}
