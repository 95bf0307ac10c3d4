//! Bytes as text, for data that stands within HTML, SVG and VTK files.

/// Encodes bytes in standard base64 (RFC 4648 §4, with padding), on one line; no bytes give an empty text.
///
/// ```
/// // RFC 4648, section 10.
/// assert_eq!(["f", "fo", "foobar"].map(|text| lampyris::formats::base64(text.as_bytes())), ["Zg==", "Zm8=", "Zm9vYmFy"]);
/// ```
pub fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    // Three bytes are 24 bits, which four letters of six bits take.
    let letters = |[a, b, c]: [u8; 3]| {
        let word = u32::from_be_bytes([0, a, b, c]);
        [18, 12, 6, 0].map(|shift| ALPHABET[(word >> shift & 63) as usize])
    };
    let mut text = Vec::with_capacity(bytes.len().div_ceil(3) * 4);
    let (whole, rest) = bytes.as_chunks::<3>();
    whole.iter().for_each(|&chunk| text.extend_from_slice(&letters(chunk)));
    if !rest.is_empty() {
        // One or two bytes are filled up with zero bits, RFC 4648 §3.5.
        let mut chunk = [0; 3];
        chunk[..rest.len()].copy_from_slice(rest);
        let used = rest.len() + 1;
        text.extend_from_slice(&letters(chunk)[..used]);
        text.resize(text.len() + 4 - used, b'=');
    }
    String::from_utf8(text).expect("letters of the alphabet")
}

#[cfg(test)]
mod tests {
    use super::base64;

    #[test]
    fn the_vectors_of_rfc_4648() {
        for (plain, coded) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }
}
