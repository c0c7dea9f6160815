//! The fields of a line of CSV, none of which is quoted.

use std::str::FromStr;

use crate::stage::Failure;

/// As many fields as a header names.
#[derive(Clone, Debug)]
pub struct Fields<'a>(Vec<&'a str>);

impl<'a> Fields<'a> {
    /// The fields of a line.
    ///
    /// # Errors
    /// If there are not as many as in the header.
    pub fn of(line: &'a str, header: &str) -> Result<Self, Failure> {
        let fields: Vec<&str> = line.split(',').collect();
        let expected = header.split(',').count();
        if fields.len() != expected {
            return Err(format!("{} fields instead of {expected}: {line}", fields.len()).into());
        }
        Ok(Self(fields))
    }

    /// A field as it is; empty if the header has none of that number.
    #[must_use]
    pub fn text(&self, index: usize) -> &'a str {
        self.0.get(index).copied().unwrap_or_default()
    }

    /// A field that is a number.
    ///
    /// # Errors
    /// If it is none of its kind.
    pub fn number<T: FromStr>(&self, index: usize) -> Result<T, Failure> {
        let text = self.text(index);
        text.parse()
            .map_err(|_| format!("not a number: {text}").into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_counted_and_numbers_are_numbers() {
        let fields = Fields::of("p01,7,-0.5,", "scene,photons,error,flip").unwrap();
        assert_eq!((fields.text(0), fields.text(3)), ("p01", ""));
        assert_eq!(fields.number::<u32>(1).unwrap(), 7);
        assert_eq!(fields.number::<f64>(2).unwrap(), -0.5);
        assert!(fields.number::<u32>(2).is_err() && fields.number::<f64>(3).is_err());
        assert!(Fields::of("p01,7", "scene,photons,error").is_err());
    }
}
