//! Bytes as text, for data that stands within HTML, SVG and VTK files.

/// Encodes bytes in standard base64 (RFC 4648 §4, with padding), on one line; no bytes give an empty text.
///
/// ```
/// // RFC 4648, section 10.
/// assert_eq!(["f", "fo", "foobar"].map(|text| lampyris::formats::base64(text.as_bytes())), ["Zg==", "Zm8=", "Zm9vYmFy"]);
/// ```
pub fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        // A last chunk of one or two bytes is filled up with zero bits, RFC 4648 §3.5. The first byte of the word stays empty: three bytes
        // are 24 bits, which four letters of six bits take.
        let mut bytes = [0; 4];
        bytes[1..=chunk.len()].copy_from_slice(chunk);
        let word = u32::from_be_bytes(bytes);
        for k in 0..4 {
            let used = k <= chunk.len();
            text.push(if used { ALPHABET[(word >> (18 - 6 * k) & 63) as usize] as char } else { '=' });
        }
    }
    text
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
