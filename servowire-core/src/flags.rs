use core::fmt;

/// Writes names with a blank between them: how the crates print a flag set, `OF BE BA`. Nothing for none.
pub fn write_names<'a>(f: &mut fmt::Formatter<'_>, names: impl IntoIterator<Item = &'a str>) -> fmt::Result {
    for (at, name) in names.into_iter().enumerate() {
        if at > 0 {
            f.write_str(" ")?;
        }
        f.write_str(name)?;
    }
    Ok(())
}
