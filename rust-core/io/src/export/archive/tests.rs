use std::io::{Cursor, Read, Seek, SeekFrom};

use super::*;
use proptest::prelude::*;
use zip::ZipArchive;

/// An archive of these members.
fn written(members: &[(&'static str, &[u8])], level: Compression) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut archive = Archive::new(&mut bytes, level);
    for (name, content) in members {
        archive.add(name, content.len() as u64, |out| out.write_all(content)).unwrap();
    }
    archive.finish().unwrap();
    bytes
}

fn unpacked<R: Read + Seek>(zip: &mut ZipArchive<R>, name: &str) -> Vec<u8> {
    let mut content = Vec::new();
    zip.by_name(name).unwrap().read_to_end(&mut content).unwrap();
    content
}

fn at(bytes: &[u8], place: usize, count: usize) -> u64 {
    bytes[place..place + count].iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(40)))]
    // Theorem: members come back in their order, whatever they hold and however they are handed over. The bytes depend on that alone.
    #[test]
    fn members_come_back(
        noise in prop::collection::vec(any::<u8>(), 0..3 * PIECE),
        zeros in 0..5 * PIECE,
        level in 0_u32..10,
        cut in 1..2 * PIECE,
    ) {
        let zeros = vec![0; zeros];
        let members = [("noise", noise.as_slice()), ("a/zeros", &zeros), ("nothing", &[])];
        let bytes = written(&members, Compression::new(level));
        let mut zip = ZipArchive::new(Cursor::new(&bytes)).unwrap();
        prop_assert_eq!(zip.file_names().map(|name| name.unwrap().into_owned()).collect::<Vec<_>>(), ["noise", "a/zeros", "nothing"]);
        for (name, content) in members {
            prop_assert!(unpacked(&mut zip, name) == content);
        }
        let mut pieces = Vec::new();
        let mut archive = Archive::new(&mut pieces, Compression::new(level));
        for (name, content) in members {
            let each = |out: &mut Packing<'_, _>| content.chunks(cut).try_for_each(|piece| out.write_all(piece));
            archive.add(name, content.len() as u64, each).unwrap();
        }
        archive.finish().unwrap();
        prop_assert!(pieces == bytes);
    }
}

/// Theorem: a member that may be large, but is not, has lengths of eight bytes in itself and of four in the list.
#[test]
fn lengths_have_room_beforehand() {
    let mut bytes = Vec::new();
    let mut archive = Archive::new(&mut bytes, Compression::default());
    archive.add("member", LARGE, |out| out.write_all(b"content")).unwrap();
    archive.finish().unwrap();
    let mut zip = ZipArchive::new(Cursor::new(&bytes)).unwrap();
    let (list, begin) =
        (zip.central_directory_start() as usize, zip.by_index(0).unwrap().data_start().unwrap() as usize);
    assert_eq!(unpacked(&mut zip, "member"), b"content");
    // The version, both lengths, and the extra field's number and length.
    assert_eq!((at(&bytes, 4, 2), at(&bytes, 18, 4), at(&bytes, 22, 4)), (45, LARGE, LARGE));
    assert_eq!((at(&bytes, 28, 2), at(&bytes, 36, 2), at(&bytes, 38, 2)), (20, 1, 16));
    let packed = at(&bytes, list + 20, 4);
    assert_eq!((at(&bytes, list + 24, 4), at(&bytes, list + 30, 2)), (7, 0));
    assert_eq!((at(&bytes, list - 16, 8), at(&bytes, list - 8, 8)), (packed, 7));
    assert_eq!(list, begin + packed as usize + 24);
}

#[test]
#[should_panic(expected = "member has 3 bytes, more than the 2 that were said")]
fn a_member_keeps_to_its_bound() {
    let mut archive = Archive::new(Vec::new(), Compression::default());
    _ = archive.add("member", 2, |out| out.write_all(b"abc"));
}

/// Theorem: lengths and places beyond four bytes come back.
#[test]
fn places_beyond_four_bytes_come_back() {
    let far = 5 << 30;
    let mut file = tempfile::tempfile().unwrap();
    file.seek(SeekFrom::Start(far)).unwrap();
    let mut archive = Archive::new(&mut file, Compression::default());
    archive.at = far;
    archive.add("member", 7, |out| out.write_all(b"content")).unwrap();
    archive.finish().unwrap();
    let mut zip = ZipArchive::new(&mut file).unwrap();
    assert_eq!(zip.by_index(0).unwrap().header_start(), far);
    assert_eq!(unpacked(&mut zip, "member"), b"content");
    let member = Member { name: "m", at: 1, crc: 2, packed: LARGE, unpacked: LARGE + 7, is_large: true };
    let entry = member.entry();
    assert_eq!((at(&entry, 20, 4), at(&entry, 24, 4), at(&entry, 42, 4)), (LARGE, LARGE, 1));
    assert_eq!((at(&entry, 47, 2), at(&entry, 49, 2)), (1, 16));
    assert_eq!((at(&entry, 51, 8), at(&entry, 59, 8)), (LARGE + 7, LARGE));
    assert_eq!(entry.len(), 67);
}

mod thorough {
    use super::*;

    /// Theorem: a member of more than 4 GiB comes back.
    #[test]
    fn more_than_four_bytes_count_come_back() {
        let (piece, count) = (vec![0_u8; 1 << 20], 4097_u64);
        let mut bytes = Vec::new();
        let mut archive = Archive::new(&mut bytes, Compression::fast());
        archive.add("zeros", count << 20, |out| (0..count).try_for_each(|_| out.write_all(&piece))).unwrap();
        archive.finish().unwrap();
        let mut zip = ZipArchive::new(Cursor::new(&bytes)).unwrap();
        let mut member = zip.by_name("zeros").unwrap();
        assert_eq!(member.size(), count << 20);
        // Reading to the end compares the checksum.
        assert_eq!(std::io::copy(&mut member, &mut std::io::sink()).unwrap(), count << 20);
    }
}
