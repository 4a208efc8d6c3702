//! Which topics there are. A new protocol is one file here and one line in [`ALL`].

mod hdsl;
mod nikon;
mod rtex;
mod sorte;
mod step_profile;
mod tformat;

use crate::row::Check;

/// A protocol's folder name and its topics.
type Protocol = (&'static str, &'static [(&'static str, Check)]);

const ALL: &[Protocol] = &[
    ("hdsl", hdsl::TOPICS),
    ("nikon", nikon::TOPICS),
    ("rtex", rtex::TOPICS),
    ("sorte", sorte::TOPICS),
    ("step-profile", step_profile::TOPICS),
    ("tformat", tformat::TOPICS),
];

pub(crate) fn names() -> Vec<&'static str> {
    ALL.iter().map(|(name, _)| *name).collect()
}

pub(crate) fn topics(protocol: &str) -> Vec<&'static str> {
    of(protocol).iter().map(|(topic, _)| *topic).collect()
}

pub(crate) fn check(protocol: &str, topic: &str) -> Option<Check> {
    of(protocol).iter().find(|(name, _)| *name == topic).map(|(_, check)| *check)
}

fn of(protocol: &str) -> &'static [(&'static str, Check)] {
    ALL.iter().find(|(name, _)| *name == protocol).map_or(&[], |(_, topics)| topics)
}
