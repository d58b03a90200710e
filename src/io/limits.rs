//! Limits of what is read, and the sentences for what exceeds them.

/// Packed data may unpack to this many times its size, and [`UNPACKED_BYTES`] more.
///
/// Text of numbers packs to a third or a tenth. Files made to fill memory unpack to nearly 1,000
/// times their size, the most that DEFLATE can.
pub(super) const UNPACKED_TIMES: u64 = 100;
/// What packed data of any size may unpack to. A file of a few zeros packs to nearly nothing.
pub(super) const UNPACKED_BYTES: u64 = 256 << 20;

/// The most bytes that `packed_bytes` may unpack to.
pub(super) fn most_unpacked(packed_bytes: u64) -> u64 {
    packed_bytes.saturating_mul(UNPACKED_TIMES).saturating_add(UNPACKED_BYTES)
}

/// The most bytes in a row of a table. The longest names are far shorter.
pub(super) const ROW_BYTES: u64 = 16 << 20;

/// Why bytes are not read on, as a sentence for [`Source::failed`].
#[derive(Debug, thiserror::Error)]
pub(super) enum Refusal {
    #[error(
        "the gzip data unpacks to more than {UNPACKED_TIMES} times its size and {} MiB: if it is meant to, unpack it with \
         gunzip and give the file itself", UNPACKED_BYTES >> 20
    )]
    Unpacked,
    #[error("a row is longer than {} MiB: end the rows, and close quotation marks", ROW_BYTES >> 20)]
    Row,
    #[error("the text begins as UTF-16, and is damaged or cut off: save the file as UTF-8")]
    Utf16,
}
