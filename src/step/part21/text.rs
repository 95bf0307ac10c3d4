//! Texts: `''`, `\S\`, `\P?\`, `\X\`, `\X2\…\X0\`, `\X4\…\X0\`, and raw bytes, which real files hold as UTF-8 or Latin-1.

/// Decodes what stands between the apostrophes of a text. Line breaks are dropped; escapes that are unknown or broken stay as they are.
pub(super) fn decode(raw: &[u8]) -> String {
    // Raw bytes are UTF-8 if they are valid as such, otherwise Latin-1.
    let text = std::str::from_utf8(raw);
    let is_itself = |b: &u8| *b >= b' ' && !matches!(b, b'\'' | b'\\');
    // Most texts are nothing but themselves.
    if let Ok(text) = text
        && raw.iter().all(is_itself)
    {
        return text.to_owned();
    }
    let utf8 = text.is_ok();
    let mut out = String::with_capacity(raw.len());
    let mut i = 0;
    let mut plain: Vec<u8> = Vec::new();
    let flush = |plain: &mut Vec<u8>, out: &mut String| {
        if utf8 {
            out.push_str(&String::from_utf8_lossy(plain));
        } else {
            out.extend(plain.iter().map(|&b| char::from(b)));
        }
        plain.clear();
    };
    while i < raw.len() {
        let rest = &raw[i..];
        if rest.starts_with(b"''") {
            plain.push(b'\'');
            i += 2;
        } else if rest.starts_with(b"\\\\") {
            plain.push(b'\\');
            i += 2;
        } else if let Some((text, used)) = decode_escape(rest) {
            flush(&mut plain, &mut out);
            out.push_str(&text);
            i += used;
        } else {
            // Line breaks and other controls inside of a text come from folding its lines.
            if raw[i] >= b' ' {
                plain.push(raw[i]);
            }
            i += 1;
        }
    }
    flush(&mut plain, &mut out);
    out
}

/// Reads a control directive at the start of `rest`: what it stands for, maybe nothing, and its length in bytes. `None` where there is
/// none.
fn decode_escape(rest: &[u8]) -> Option<(String, usize)> {
    if rest.starts_with(b"\\S\\") {
        // An apostrophe is written twice in a text, here too.
        let used = if rest[3..].starts_with(b"''") { 5 } else { 4 };
        return rest.get(3).map(|&b| (char::from(b | 0x80).to_string(), used));
    }
    // The choice of a page of ISO 8859: `\S\` is read by the first of them, Latin-1, whatever it says.
    if rest.starts_with(b"\\P") && rest.get(3) == Some(&b'\\') {
        return Some((String::new(), 4));
    }
    if rest.starts_with(b"\\N\\") || rest.starts_with(b"\\F\\") {
        return Some((String::new(), 3));
    }
    if rest.starts_with(b"\\X\\") {
        return Some((char::from(parse_hex(rest.get(3..5)?)? as u8).to_string(), 5));
    }
    let wide = rest.starts_with(b"\\X4\\");
    if !wide && !rest.starts_with(b"\\X2\\") {
        return None;
    }
    // Codes hold no backslash: the first one is the end, or there is none. To search for `\\X0\\` took 40 s for a name of 1 MB that
    // only begins such runs.
    let length = rest[4..].iter().position(|&b| b == b'\\')?;
    let end = 4 + length;
    if !rest[end..].starts_with(b"\\X0\\") {
        return None;
    }
    // Writers fold lines inside of codes too.
    let codes: Vec<u8> = rest[4..end].iter().copied().filter(|b| *b > b' ').collect();
    let text = if wide {
        // What is no character is shown as one that says so.
        codes.chunks(8).map(|c| parse_hex(c).and_then(char::from_u32).unwrap_or('\u{fffd}')).collect()
    } else {
        // Edition 2 calls these codes UCS-2; writers put UTF-16 with its surrogates there.
        let units: Vec<u16> = codes.chunks(4).map(|c| parse_hex(c).unwrap_or(0xfffd) as u16).collect();
        String::from_utf16_lossy(&units)
    };
    Some((text, end + 4))
}

/// Reads up to eight digits; `None` where one is none, such as the sign that Rust's own reading takes.
fn parse_hex(digits: &[u8]) -> Option<u32> {
    if !digits.iter().all(u8::is_ascii_hexdigit) {
        return None;
    }
    u32::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok()
}

#[cfg(test)]
mod tests {
    use super::decode;

    #[test]
    fn all_encodings() {
        assert_eq!(decode(b"it''s"), "it's");
        assert_eq!(decode(b"\\X\\E9t\\X\\E9"), "été");
        assert_eq!(decode(b"\\S\\d"), "ä");
        assert_eq!(decode(b"\\X2\\041B04380441\\X0\\t"), "Лисt");
        assert_eq!(decode(b"\\X4\\0001F600\\X0\\"), "😀");
        assert_eq!(decode(b"\\X2\\041704\r\n350440\n043A\\X0\\"), "Зерк");
        assert_eq!(decode(b"A\\S\\''B"), "A§B");
        assert_eq!(decode(b"\xe9t\xe9"), "été");
        assert_eq!(decode("été".as_bytes()), "été");
        assert_eq!(decode(b"a\\\\b"), "a\\b");
        assert_eq!(decode(b"\\X2\\broken"), "\\X2\\broken");
        // A sign is no digit.
        assert_eq!(decode(b"\\X\\+9t"), "\\X\\+9t");
        assert_eq!(decode(b"\\X2\\+041\\X0\\"), "\u{fffd}");
    }
}
