//! Small files that claim, or unpack to, more than memory holds: each is a sentence in bounded
//! memory.

use std::io::Write;
use std::process::{Command, Output};

use flate2::Compression;
use flate2::write::{DeflateEncoder, GzEncoder};
use tempfile::TempDir;

/// The program may have so many KiB of addresses. Each of its threads reserves 128 MiB, that which waits for signals too.
const LIMIT_KIB: u64 = 1_500_000 + (128 << 10);

/// An entry of an archive, which says what it likes.
struct Entry {
    name: &'static str,
    /// As it stands in the archive, packed or not.
    bytes: Vec<u8>,
    packed: bool,
    unpacked_bytes: u64,
    checksum: u32,
}

impl Entry {
    fn stored(name: &'static str, bytes: Vec<u8>) -> Self {
        let checksum = checksum(&bytes);
        Entry { name, unpacked_bytes: bytes.len() as u64, bytes, packed: false, checksum }
    }

    fn packed(name: &'static str, bytes: &[u8]) -> Self {
        let mut packed = DeflateEncoder::new(Vec::new(), Compression::best());
        packed.write_all(bytes).unwrap();
        let packed = packed.finish().unwrap();
        Entry { name, unpacked_bytes: bytes.len() as u64, bytes: packed, packed: true, checksum: checksum(bytes) }
    }
}

fn checksum(bytes: &[u8]) -> u32 {
    let mut crc = flate2::Crc::new();
    crc.update(bytes);
    crc.sum()
}

/// An archive as zip lays it out, with sizes in 32 bits.
fn archive(entries: &[Entry]) -> Vec<u8> {
    let (mut zip, mut directory) = (Vec::new(), Vec::new());
    for entry in entries {
        let at = zip.len() as u32;
        let file = format!("{}.npy", entry.name);
        // Version, flags, method, time, date; checksum, sizes; lengths of the name and of what is
        // extra.
        let mut common = [20u16, 0, if entry.packed { 8 } else { 0 }, 0, 33].map(u16::to_le_bytes).concat();
        let sizes = [entry.checksum, entry.bytes.len() as u32, entry.unpacked_bytes as u32];
        common.extend(sizes.map(u32::to_le_bytes).concat());
        common.extend([file.len() as u16, 0].map(u16::to_le_bytes).concat());
        zip.extend(b"PK\x03\x04");
        zip.extend(&common);
        zip.extend(file.as_bytes());
        zip.extend(&entry.bytes);
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(&common);
        directory.extend([0; 10]);
        directory.extend(at.to_le_bytes());
        directory.extend(file.as_bytes());
    }
    let at = zip.len() as u32;
    zip.extend(&directory);
    zip.extend(b"PK\x05\x06\0\0\0\0");
    zip.extend([entries.len() as u16; 2].map(u16::to_le_bytes).concat());
    zip.extend([directory.len() as u32, at].map(u32::to_le_bytes).concat());
    zip.extend([0, 0]);
    zip
}

fn npy(descr: &str, shape: &str, bytes: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}\n");
    let mut array = b"\x93NUMPY\x01\x00".to_vec();
    array.extend((header.len() as u16).to_le_bytes());
    array.extend(header.as_bytes());
    array.extend(bytes);
    array
}

/// `text` so often, in gzip members of a MiB.
fn gzip_of(text: &str, bytes: usize) -> Vec<u8> {
    let mut member = GzEncoder::new(Vec::new(), Compression::best());
    let block = text.repeat((1 << 20) / text.len());
    member.write_all(block.as_bytes()).unwrap();
    member.finish().unwrap().repeat(bytes / block.len())
}

/// Runs the program on a file with little memory.
fn run(command: &str, name: &str, bytes: &[u8]) -> Output {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join(name), bytes).unwrap();
    let program = assert_cmd::cargo::cargo_bin!("faircurve");
    Command::new("sh")
        .args(["-c", &format!("ulimit -v {LIMIT_KIB}; exec \"$0\" {command}")])
        .arg(program)
        .current_dir(folder.path())
        .output()
        .unwrap()
}

/// What the program says of a file that must be refused, but for how far it is.
fn said(command: &str, name: &str, bytes: &[u8]) -> String {
    let output = run(&format!("{command} --quiet"), name, bytes);
    let sentence = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{name}: {sentence}");
    assert!(sentence.chars().count() < 1000 && sentence.lines().count() == 1, "{name}: {sentence}");
    sentence.trim().to_string()
}

fn curves(name: &str, bytes: &[u8]) -> String {
    said(&format!("fit {name} --device cpu -o out.csv"), name, bytes)
}

fn grids(name: &str, bytes: &[u8]) -> String {
    said(&format!("grid {name} --device cpu -o out.npz"), name, bytes)
}

#[cfg(target_os = "linux")]
#[test]
fn gzip_data_that_fills_memory_is_a_sentence() {
    let sentence = "the gzip data unpacks to more than 100 times its size and 256 MiB: if it is meant to, unpack it with \
                    gunzip and give the file itself";
    let bomb = |text: &str| gzip_of(text, 400 << 20);
    assert!(bomb("0,").len() < 2 << 20);
    assert_eq!(grids("a.csv.gz", &bomb("0,")), format!("faircurve: a.csv.gz: {sentence}"));
    assert_eq!(curves("a.geojson.gz", &bomb(" ")), format!("faircurve: a.geojson.gz: {sentence}"));
    assert_eq!(curves("a.svg.gz", &bomb("<")), format!("faircurve: a.svg.gz: {sentence}"));
    assert_eq!(grids("a.npz.gz", &bomb("P")), format!("faircurve: a.npz.gz: {sentence}"));
    let one_cell = curves("a.csv.gz", &[gzip("x,y\n1,\""), bomb("1,")].concat());
    let one_line = curves("a.csv.gz", &bomb("a,"));
    assert_eq!(one_cell, one_line);
    assert_eq!(one_cell, "faircurve: a.csv.gz: a row is longer than 16 MiB: end the rows, and close quotation marks");
}

fn gzip(text: &str) -> Vec<u8> {
    let mut member = GzEncoder::new(Vec::new(), Compression::best());
    member.write_all(text.as_bytes()).unwrap();
    member.finish().unwrap()
}

#[cfg(target_os = "linux")]
#[test]
fn what_takes_more_memory_than_there_is_is_a_sentence() {
    let full = |sentence: String| {
        assert!(sentence.contains(": reading it takes ") && sentence.contains(" may be taken: give it"), "{sentence}");
    };
    // Within the ratio, but too much for the limit of the process.
    let rows = [gzip("x,y\n"), gzip_of("0,0\n", 250 << 20)].concat();
    full(curves("a.csv.gz", &rows));
    full(grids("a.csv.gz", &gzip_of("0,1\n", 250 << 20)));
    let lines = [gzip("{\"type\":\"MultiLineString\",\"coordinates\":[[]"), gzip_of(",[]", 100 << 20), gzip("]}")];
    full(curves("a.json.gz", &lines.concat()));
    let elements = [gzip("<svg>"), gzip_of("<a/>", 100 << 20), gzip("</svg>")].concat();
    full(curves("a.svg.gz", &elements));
    let bytes = npy("'|u1'", "(15000, 15000)", &vec![0; 225_000_000]);
    full(grids("a.npz", &archive(&[Entry::packed("grids", &bytes)])));
}

#[cfg(target_os = "linux")]
#[test]
fn archives_that_unpack_to_too_much_are_a_sentence() {
    let bytes = npy("'<f8'", "(6000, 7000)", &vec![0; 336_000_000]);
    let packed = Entry::packed("grids", &bytes);
    assert!(packed.bytes.len() < 2 << 20);
    assert_eq!(
        grids("a.npz", &archive(&[packed])),
        "faircurve: a.npz: array grids brings what the archive unpacks to above 100 times its size and 256 MiB: if it is \
         meant to, write the file with numpy.savez, which does not pack"
    );
}

#[cfg(target_os = "linux")]
#[test]
fn arrays_that_lie_about_their_size_are_a_sentence() {
    let say = |array: Vec<u8>| {
        let sentence = grids("a.npz", &archive(&[Entry::stored("grids", array)]));
        sentence.strip_prefix("faircurve: a.npz: array grids ").unwrap().to_string()
    };
    let mut header = b"\x93NUMPY\x02\x00\xff\xff\xff\xff".to_vec();
    header.extend([b' '; 100]);
    assert_eq!(
        say(header),
        "is damaged or cut off (its header has 4294967295 bytes, and 10000 are the most): write the file again"
    );
    let less = |shape: &str| format!("has the shape {shape}, but holds less: write the file again");
    assert_eq!(say(npy("'|S0'", "(1152921504606846976,)", b"")), less("(1152921504606846976,)"));
    assert_eq!(say(npy("'<U0'", "(1, 1152921504606846976)", b"")), less("(1, 1152921504606846976)"));
    assert_eq!(say(npy("'<f8'", "(4294967296, 4294967296)", b"")), less("(4294967296, 4294967296)"));
    assert_eq!(say(npy("'<f8'", "(1000000, 1000)", b"12345678")), less("(1000000, 1000)"));
    let nested = format!("{}'<f8'{}", "[".repeat(3000), "]".repeat(3000));
    assert!(say(npy(&nested, "(1, 1)", b"12345678")).starts_with("has the type [[[["));
    let mut lie = Entry::stored("grids", npy("'<f8'", "(20000, 20000)", b""));
    lie.unpacked_bytes = u64::from(u32::MAX) - 1;
    assert!(grids("a.npz", &archive(&[lie])).contains("above 100 times its size and 256 MiB"));
}

#[cfg(target_os = "linux")]
#[test]
fn an_archive_that_claims_more_entries_than_it_has_bytes_for_is_a_sentence() {
    // Sixty-four bits of footer, their locator, and the old footer, after bytes that make the claim
    // look small.
    let mut zip = vec![b' '; 30_000_000];
    let at = zip.len() as u64;
    zip.extend(b"PK\x06\x06");
    zip.extend(44u64.to_le_bytes());
    zip.extend([0; 12]);
    zip.extend([20_000_000u64, 20_000_000, 0, 0].map(u64::to_le_bytes).concat());
    zip.extend(b"PK\x06\x07\0\0\0\0");
    zip.extend(at.to_le_bytes());
    zip.extend(1u32.to_le_bytes());
    zip.extend(b"PK\x05\x06\0\0\0\0");
    zip.extend([0xff; 12]);
    zip.extend([0, 0]);
    assert_eq!(
        curves("a.npz", &zip),
        "faircurve: a.npz: the archive claims more arrays than it has bytes for: write the file again"
    );
}

#[test]
fn a_wrong_checksum_names_the_array() {
    let numbers: Vec<u8> = [1.0f64, 2.0, 3.0, 4.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let coords = npy("'<f8'", "(2, 2)", &numbers);
    let offsets = npy("'|u1'", "(2,)", &[0, 2]);
    let of = |mut entries: [Entry; 2], wrong: Option<usize>| {
        if let Some(wrong) = wrong {
            entries[wrong].checksum ^= 1;
        }
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("a.npz");
        std::fs::write(&path, archive(&entries)).unwrap();
        faircurve::io::read(&path).map_err(|error| super::errors::without_folder(&error.to_string(), folder.path()))
    };
    let stored = || [Entry::stored("coords", coords.clone()), Entry::stored("offsets", offsets.clone())];
    let packed = || [Entry::packed("coords", &coords), Entry::packed("offsets", &offsets)];
    for entries in [&stored as &dyn Fn() -> [Entry; 2], &packed] {
        assert_eq!(of(entries(), None).unwrap().coords(), [1.0, 2.0, 3.0, 4.0]);
        for (wrong, name) in ["coords", "offsets"].iter().enumerate() {
            assert_eq!(
                of(entries(), Some(wrong)).unwrap_err(),
                format!("a.npz: array {name} is damaged or cut off (Invalid checksum): write the file again")
            );
        }
    }
    let more = npy("'|u1'", "(2,)", &[0, 2, 5]);
    assert_eq!(
        of([Entry::stored("coords", coords.clone()), Entry::stored("offsets", more)], None).unwrap_err(),
        "a.npz: array offsets has the shape (2,), but holds more: write the file again"
    );
}

#[cfg(target_os = "linux")]
#[test]
fn drawings_that_grow_without_end_are_a_sentence() {
    let say = |text: String| curves("a.svg", text.as_bytes()).strip_prefix("faircurve: a.svg").unwrap().to_string();
    let document = |entities: &str, body: &str| format!("<!DOCTYPE svg [{entities}]>\n<svg>{body}</svg>");
    // Quadratic: one long entity, many references.
    let long = format!("<!ENTITY a '{}'>", "0".repeat(100_000));
    let many = format!("<path d='{}'/>", "&a;".repeat(100_000));
    assert_eq!(
        say(document(&long, &many)),
        ": its entities may make 9536 MiB of text, and 16 MiB are the most: write the file without them"
    );
    // Exponential: entities of entities.
    let laughs: String = (1..10).map(|k| format!("<!ENTITY a{k} '{}'>", format!("&a{};", k - 1).repeat(10))).collect();
    assert!(say(document(&format!("<!ENTITY a0 'lol'>{laughs}"), "&a9;")).contains("this is no XML"));
    let wide: String = (1..4).map(|k| format!("<!ENTITY a{k} '{}'>", format!("&a{};", k - 1).repeat(60))).collect();
    let sentence = say(document(&format!("<!ENTITY a0 '<a/>'>{wide}"), &"&a3;".repeat(1000)));
    assert!(sentence.starts_with(": its entities may make "), "{sentence}");
    let attributes: String = (0..200_000).map(|k| format!(" a{k}=''")).collect();
    assert_eq!(
        say(format!("<svg><path{attributes}/></svg>")),
        ": an element has more than 10000 attributes: give an SVG file"
    );
    let nested: String = (0..100_000).map(|k| format!("<a xmlns:n{k}=''>")).collect();
    assert_eq!(say(format!("<svg>{nested}")), ": there are more than 64 names of namespaces: give an SVG file");
}

#[cfg(target_os = "linux")]
#[test]
fn what_is_large_but_honest_is_read_with_little_memory() {
    let rows: String = (0..200_000).map(|k| format!("{k},{}.5\n", k % 97)).collect();
    let output = run("fit a.csv --device cpu -o out.csv", "a.csv", format!("x,y\n{rows}").as_bytes());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let bytes = npy("'<f8'", "(1000, 1000)", &vec![0; 8_000_000]);
    let output = run("grid a.npz --device cpu -o out.npz", "a.npz", &archive(&[Entry::packed("grids", &bytes)]));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
