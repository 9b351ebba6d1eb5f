//! Cost of reading a recording beside that of decoding its images, by the same decoders called without us: CPU seconds as a line of JSON.
//! Usage: decoders decoders|frames|read RECORDING
//!
//! `decoders` decodes each image into a buffer. `frames` reads the same images as frames, with their cameras. `read` makes range images
//! with colours of them. Opening, which looks at some frames, is a number of its own.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::hint::black_box;
use std::io::Read as _;
use std::path::Path;

use surfrecon::{Progress, import};
use zune_core::bytestream::ZCursor;
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;

/// CPU seconds of this thread, on which all is decoded, as Linux counts them.
fn cpu_s() -> f64 {
    // Linux counts up a thread that runs at ticks, some milliseconds apart, and where it yields.
    std::thread::yield_now();
    let counted = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    1e-9 * counted.split(' ').next().unwrap().parse::<f64>().unwrap()
}

/// Bytes of pixels that a PNG file becomes.
fn png(bytes: &[u8]) -> usize {
    let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::IDENTITY);
    let mut reader = decoder.read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    black_box(pixels).len()
}

fn jpeg(bytes: &[u8]) -> usize {
    let options = DecoderOptions::default().jpeg_set_out_colorspace(ColorSpace::RGB);
    let pixels = zune_jpeg::JpegDecoder::new_with_options(ZCursor::new(bytes), options).decode().unwrap();
    black_box(pixels).len()
}

fn lzfse(bytes: &[u8]) -> usize {
    let mut unpacked = Vec::new();
    lzfse_rust::decode_bytes(bytes, &mut unpacked).unwrap();
    black_box(unpacked).len()
}

fn zlib(bytes: &[u8]) -> usize {
    let mut unpacked = Vec::new();
    flate2::read::ZlibDecoder::new(bytes).read_to_end(&mut unpacked).unwrap();
    black_box(unpacked).len()
}

fn exr(bytes: &[u8]) -> usize {
    use exr::prelude::{ReadChannels as _, ReadLayers as _};
    let file = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
    let image = file.all_attributes().non_parallel().from_buffered(std::io::Cursor::new(bytes)).unwrap();
    black_box(image).layer_data.size.area()
}

/// COLMAP's maps are floats behind a line of text.
fn floats(bytes: &[u8]) -> usize {
    let start = bytes.iter().enumerate().filter(|(_, byte)| **byte == b'&').nth(2).unwrap().0 + 1;
    let floats: Vec<f32> = bytes[start..].as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    black_box(floats).len()
}

/// The images of ScanNet's one file.
fn sens(bytes: &[u8]) -> usize {
    let long = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize;
    // Version and name, four matrices, two codings and four sides, the unit.
    let mut at = 4 + 8 + long(4) + 4 * 64 + 6 * 4 + 4;
    let (count, mut pixels) = (long(at), 0);
    at += 8;
    for _ in 0..count {
        let (colour, depth) = (long(at + 64 + 16), long(at + 64 + 24));
        at += 64 + 32;
        pixels += jpeg(&bytes[at..at + colour]) + zlib(&bytes[at + colour..at + colour + depth]);
        at += colour + depth;
    }
    pixels
}

/// Decodes an image by what its name says that it is. Lists are none.
fn decode(name: &str, bytes: &[u8]) -> usize {
    match name.rsplit('.').next().unwrap_or_default() {
        "png" => png(bytes),
        "jpg" => jpeg(bytes),
        "depth" | "conf" => lzfse(bytes),
        "exr" => exr(bytes),
        "bin" => floats(bytes),
        "sens" => sens(bytes),
        _ => 0,
    }
}

/// Decodes all images of a folder, an archive or a file.
fn decode_all(path: &Path) -> usize {
    if path.is_dir() {
        return std::fs::read_dir(path).unwrap().map(|entry| decode_all(&entry.unwrap().path())).sum();
    }
    let name = path.to_str().unwrap();
    if !name.ends_with(".r3d") {
        return decode(name, &std::fs::read(path).unwrap());
    }
    let mut archive = zip::ZipArchive::new(std::fs::File::open(path).unwrap()).unwrap();
    let mut pixels = 0;
    for index in 0..archive.len() {
        let mut bytes = Vec::new();
        let mut member = archive.by_index(index).unwrap();
        member.read_to_end(&mut bytes).unwrap();
        pixels += decode(&member.name().unwrap(), &bytes);
    }
    pixels
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, way, path] = &arguments[..] else { panic!("usage: decoders decoders|frames|read RECORDING") };
    let (path, none) = (Path::new(path), Progress::none());
    let start = cpu_s();
    let mut opened = start;
    let count = if way == "decoders" {
        decode_all(path)
    } else {
        let set = import::open(path).unwrap();
        opened = cpu_s();
        for scan in &set.scans {
            if way == "frames" {
                drop(black_box(scan.frame(&none).unwrap()));
            } else {
                drop(black_box(scan.read().unwrap()));
            }
        }
        set.scans.len()
    };
    assert!(count > 0, "there are no images in {}", path.display());
    println!("{{\"open_s\": {:.6}, \"cpu_s\": {:.6}}}", opened - start, cpu_s() - opened);
}
