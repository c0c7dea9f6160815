//! Addresses of buffers: data URIs and relative paths.

/// What a buffer's `uri` stands for.
#[derive(Debug, PartialEq)]
pub(crate) enum Address {
    /// The data itself.
    Data(Vec<u8>),
    /// A path, relative to the file's folder.
    Path(String),
}

/// Reads an address; on failure says why.
pub(crate) fn parse(uri: &str) -> Result<Address, &'static str> {
    if let Some(rest) = strip_prefix_ignoring_case(uri, "data:") {
        let (media_type, data) = rest
            .split_once(',')
            .ok_or("its data URI has no comma before the data")?;
        let data = if media_type.to_ascii_lowercase().ends_with(";base64") {
            // Base64 in a URI may itself be percent-encoded.
            decode_base64(&decode_percent(data)?)?
        } else {
            decode_percent(data)?
        };
        return Ok(Address::Data(data));
    }
    if has_scheme(uri) {
        return Err("its URI is neither data nor a relative path");
    }
    let path = String::from_utf8(decode_percent(uri)?).or(Err("its path is not UTF-8"))?;
    if path.is_empty() || path.contains('\0') {
        return Err("its path is empty or has a zero character");
    }
    Ok(Address::Path(path))
}

fn strip_prefix_ignoring_case<'a>(text: &'a str, prefix: &str) -> Option<&'a str> {
    let (head, tail) = text.split_at_checked(prefix.len())?;
    head.eq_ignore_ascii_case(prefix).then_some(tail)
}

/// Whether a URI begins with a scheme such as `https:`. A single letter is a drive's.
fn has_scheme(uri: &str) -> bool {
    let Some((scheme, _)) = uri.split_once(':') else {
        return false;
    };
    scheme.len() > 1
        && scheme.starts_with(|c: char| c.is_ascii_alphabetic())
        && scheme
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || matches!(c, '+' | '-' | '.'))
}

fn decode_percent(text: &str) -> Result<Vec<u8>, &'static str> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        rest = after;
        if first != b'%' {
            bytes.push(first);
            continue;
        }
        let digits = rest
            .split_first_chunk::<2>()
            .and_then(|([high, low], after)| {
                let digit = |byte: u8| char::from(byte).to_digit(16);
                Some((16 * digit(*high)? + digit(*low)?, after))
            });
        let (value, after) = digits.ok_or("its URI has a % without two hexadecimal digits")?;
        bytes.push(value as u8);
        rest = after;
    }
    Ok(bytes)
}

/// Base64 as in RFC 4648, with either alphabet, padded or not.
fn decode_base64(text: &[u8]) -> Result<Vec<u8>, &'static str> {
    let padding = text.iter().rev().take_while(|&&byte| byte == b'=').count();
    let digits = &text[..text.len() - padding];
    if padding > 2 || digits.len() % 4 == 1 || (padding > 0 && !text.len().is_multiple_of(4)) {
        return Err("its base64 data has the wrong length");
    }
    let mut bytes = Vec::with_capacity(digits.len() / 4 * 3 + 2);
    for group in digits.chunks(4) {
        let mut bits = 0u32;
        for &byte in group {
            let digit = match byte {
                b'A'..=b'Z' => byte - b'A',
                b'a'..=b'z' => byte - b'a' + 26,
                b'0'..=b'9' => byte - b'0' + 52,
                b'+' | b'-' => 62,
                b'/' | b'_' => 63,
                _ => return Err("its base64 data has a character that is not base64"),
            };
            bits = bits << 6 | u32::from(digit);
        }
        // A group of n digits holds n - 1 bytes; the first of them highest.
        let missing = 4 - group.len() as u32;
        let [_, triple @ ..] = (bits << (6 * missing)).to_be_bytes();
        bytes.extend(&triple[..group.len() - 1]);
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_test_vectors_of_rfc_4648() {
        for (text, data) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg==", "foob"),
            ("Zm9vYmE=", "fooba"),
            ("Zm9vYmFy", "foobar"),
            ("Zm9vYmE", "fooba"),
        ] {
            assert_eq!(
                decode_base64(text.as_bytes()).as_deref(),
                Ok(data.as_bytes()),
                "{text}"
            );
        }
        assert_eq!(
            decode_base64(b"-_+/").unwrap(),
            decode_base64(b"+/-_").unwrap()
        );
        for text in [
            "Z",
            "Zg=",
            "Zg===",
            "Zm9v=",
            "Zm9v====",
            "Zm 9",
            "Z=9v",
            "Zm9vYmFyZ",
        ] {
            assert!(decode_base64(text.as_bytes()).is_err(), "{text}");
        }
    }

    #[test]
    fn data_uris() {
        let data = |text: &str| Ok(Address::Data(text.into()));
        assert_eq!(
            parse("data:application/octet-stream;base64,Zm9v"),
            data("foo")
        );
        assert_eq!(parse("DATA:;BASE64,Zm9vYg%3D%3D"), data("foob"));
        assert_eq!(parse("data:,a%20b"), data("a b"));
        assert!(parse("data:application/octet-stream;base64").is_err());
    }

    #[test]
    fn paths() {
        let path = |text: &str| Ok(Address::Path(text.into()));
        assert_eq!(
            parse("a%20folder/b%C3%BCffer.bin"),
            path("a folder/büffer.bin")
        );
        assert_eq!(parse("../up.bin"), path("../up.bin"));
        assert_eq!(parse("a/b:c.bin"), path("a/b:c.bin"));
        assert!(parse("https://example.com/a.bin").is_err());
        assert!(parse("file:///etc/hosts").is_err());
        for text in ["", "a%2", "a%zz", "a%", "%FF.bin", "a%00b"] {
            assert!(parse(text).is_err(), "{text}");
        }
    }
}
