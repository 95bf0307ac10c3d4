//! Bytes as text, for data that stands within HTML, SVG and VTK files.

/// The two letters of each number of twelve bits: by single ones a map of cells took a quarter of the time of all its files.
static PAIRS: [[u8; 2]; 1 << 12] = {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut pairs = [[0; 2]; 1 << 12];
    let mut bits = 0;
    while bits < pairs.len() {
        pairs[bits] = [ALPHABET[bits >> 6], ALPHABET[bits & 63]];
        bits += 1;
    }
    pairs
};

/// Encodes bytes in standard base64 (RFC 4648 §4, with padding), on one line; no bytes give an empty text.
///
/// ```
/// // RFC 4648, section 10.
/// assert_eq!(["f", "fo", "foobar"].map(|text| lampyris::formats::base64(text.as_bytes())), ["Zg==", "Zm8=", "Zm9vYmFy"]);
/// ```
pub fn base64(bytes: &[u8]) -> String {
    // Three bytes are 24 bits, which four letters of six bits take.
    let letters = |[a, b, c]: [u8; 3]| {
        let word = u32::from_be_bytes([0, a, b, c]);
        let [[a, b], [c, d]] = [word >> 12, word].map(|bits| PAIRS[bits as usize % PAIRS.len()]);
        [a, b, c, d]
    };
    let mut text = vec![b'='; bytes.len().div_ceil(3) * 4];
    let (slots, _) = text.as_chunks_mut::<4>();
    let (whole, rest) = bytes.as_chunks::<3>();
    slots.iter_mut().zip(whole).for_each(|(slot, &chunk)| *slot = letters(chunk));
    if let (Some(slot), false) = (slots.last_mut(), rest.is_empty()) {
        // One or two bytes are filled up with zero bits, RFC 4648 §3.5, and their letters with `=`.
        let mut chunk = [0; 3];
        chunk[..rest.len()].copy_from_slice(rest);
        let used = rest.len() + 1;
        slot[..used].copy_from_slice(&letters(chunk)[..used]);
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
