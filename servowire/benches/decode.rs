//! Speed of the decode path over packed samples.

fn main() {}
