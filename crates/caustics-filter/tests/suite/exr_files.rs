//! EXR bytes: lossless, the same every time, read from other writers, and never a panic.

use std::io::Cursor;

use caustics_filter::{DecodeError, FileError, Image, decode_exr, encode_exr, read_exr, write_exr};
use exr::prelude::*;
use proptest::prelude::{ProptestConfig, any, prop_assert_eq, proptest};

/// A picture without two equal neighbours, with values of many magnitudes.
fn sample_image(width: u32, height: u32) -> Image {
    let pixels = (0..width * height)
        .map(|i| [0, 1, 2].map(|channel| ((3 * i + channel) as f32 * 0.37).exp2().min(1e30)))
        .collect();
    Image::from_pixels(width, height, pixels).expect("a valid size")
}

/// A file with the given channels, as another program may write it.
fn foreign(channels: &[(&str, FlatSamples)], size: (usize, usize), encoding: Encoding) -> Vec<u8> {
    let list = channels
        .iter()
        .map(|(name, samples)| AnyChannel::new(*name, samples.clone()));
    let layer = Layer::new(
        size,
        LayerAttributes::named("layer"),
        encoding,
        AnyChannels::sort(list.collect()),
    );
    let mut bytes = Cursor::new(Vec::new());
    exr::image::Image::from_layer(layer)
        .write()
        .to_buffered(&mut bytes)
        .expect("a valid layer");
    bytes.into_inner()
}

fn floats(values: &[f32]) -> FlatSamples {
    FlatSamples::F32(values.to_vec())
}

#[test]
fn infinities_and_nans_are_kept() {
    let pixels = vec![
        [f32::NAN, f32::INFINITY, -0.0],
        [f32::NEG_INFINITY, 1e-45, f32::MAX],
    ];
    let image = Image::from_pixels(1, 2, pixels).unwrap();
    let back = decode_exr(&encode_exr(&image).unwrap()).unwrap();
    let bits = |image: &Image| -> Vec<u32> {
        image
            .pixels()
            .as_flattened()
            .iter()
            .map(|value| value.to_bits())
            .collect()
    };
    assert_eq!(bits(&back), bits(&image));
}

#[test]
fn bytes_are_the_same_on_any_number_of_threads() {
    let image = sample_image(97, 61);
    let bytes = encode_exr(&image).unwrap();
    let threads: Vec<_> = (0..4)
        .map(|_| {
            let image = image.clone();
            std::thread::spawn(move || encode_exr(&image).unwrap())
        })
        .collect();
    for thread in threads {
        assert!(thread.join().unwrap() == bytes);
    }
    // Control: one changed bit of one value shows.
    let mut other = image.clone();
    let value = &mut other.pixels_mut()[5000][1];
    *value = value.next_up();
    assert!(encode_exr(&other).unwrap() != bytes);
}

#[test]
fn header_says_float_rgb() {
    let bytes = encode_exr(&sample_image(3, 2)).unwrap();
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), true).unwrap();
    let [header] = meta.headers.as_slice() else {
        panic!("one layer")
    };
    let channels: Vec<_> = header
        .channels
        .list
        .iter()
        .map(|channel| (channel.name.to_string(), channel.sample_type))
        .collect();
    let expected = ["B", "G", "R"].map(|name| (name.to_owned(), SampleType::F32));
    assert_eq!(channels, expected);
    assert_eq!(header.compression, Compression::ZIP16);
}

#[test]
fn half_floats_alpha_and_tiles_are_read() {
    let halves = |values: [f32; 4]| FlatSamples::F16(values.map(f16::from_f32).to_vec());
    let channels = [
        ("A", halves([0.0; 4])),
        ("R", halves([0.25, 1.0, 2.0, 3.0])),
        ("G", floats(&[0.1, 0.2, 0.3, 0.4])),
        ("B", halves([4.0, 5.0, 6.0, 7.0])),
        ("Z", floats(&[9.0; 4])),
    ];
    let expected = [
        [0.25, 0.1, 4.0],
        [1.0, 0.2, 5.0],
        [2.0, 0.3, 6.0],
        [3.0, 0.4, 7.0],
    ];
    for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(1, 1))] {
        for compression in [
            Compression::Uncompressed,
            Compression::PIZ,
            Compression::RLE,
        ] {
            let encoding = Encoding {
                compression,
                blocks,
                line_order: LineOrder::Increasing,
            };
            let image = decode_exr(&foreign(&channels, (2, 2), encoding)).unwrap();
            assert_eq!((image.width(), image.height()), (2, 2));
            assert_eq!(image.pixels(), expected, "{compression}");
        }
    }
}

#[test]
fn prefixed_channels_are_found_and_plain_ones_preferred() {
    let of = |value: f32| floats(&[value]);
    let mut channels = vec![
        ("View.Beauty.R", of(1.0)),
        ("View.Beauty.G", of(2.0)),
        ("View.Beauty.B", of(3.0)),
        ("Color", of(0.0)),
    ];
    let decode = |channels: &[(&str, FlatSamples)]| {
        decode_exr(&foreign(channels, (1, 1), Encoding::default()))
            .unwrap()
            .pixels()[0]
    };
    assert_eq!(decode(&channels), [1.0, 2.0, 3.0]);
    channels.extend([("R", of(4.0)), ("G", of(5.0)), ("B", of(6.0))]);
    assert_eq!(decode(&channels), [4.0, 5.0, 6.0]);
}

#[test]
fn missing_colours_are_named() {
    let channels = [("R", floats(&[0.0])), ("Depth", floats(&[0.0]))];
    let error = decode_exr(&foreign(&channels, (1, 1), Encoding::default())).unwrap_err();
    assert_eq!(
        error,
        DecodeError::NoColor {
            channels: "Depth, R".to_owned()
        }
    );
}

#[test]
fn subsampled_channels_are_refused() {
    let mut bytes = foreign(
        &[
            ("R", floats(&[1.0; 4])),
            ("G", floats(&[1.0; 4])),
            ("B", floats(&[1.0; 4])),
        ],
        (2, 2),
        Encoding::default(),
    );
    // In the channel list: name, type 2 (float), linearity and padding, sampling of x and y.
    let entry = b"G\0\x02\0\0\0\0\0\0\0\x01\0\0\0\x01\0\0\0";
    let start = bytes
        .windows(entry.len())
        .position(|window| window == entry)
        .unwrap();
    bytes[start + 10] = 2;
    bytes[start + 14] = 2;
    let error = decode_exr(&bytes).unwrap_err().to_string();
    assert!(error.contains("channel G is subsampled"), "{error}");
}

#[test]
fn a_huge_size_is_refused_before_memory_is_asked_for() {
    let mut bytes = encode_exr(&sample_image(2, 2)).unwrap();
    let name = b"dataWindow\0box2i\0\x10\0\0\0";
    let start = bytes
        .windows(name.len())
        .position(|window| window == name)
        .unwrap()
        + name.len();
    // The window's upper corner: 2^20 by 2^20 pixels, 12 TiB.
    for corner in [start + 8, start + 12] {
        bytes[corner..corner + 4].copy_from_slice(&((1 << 20) - 1_i32).to_le_bytes());
    }
    assert!(decode_exr(&bytes).is_err());
}

#[test]
fn every_prefix_is_an_error_and_every_flipped_byte_no_panic() {
    let bytes = encode_exr(&sample_image(5, 20)).unwrap();
    assert!(decode_exr(&bytes).is_ok());
    for length in 0..bytes.len() {
        assert!(
            decode_exr(&bytes[..length]).is_err(),
            "{length} of {} bytes",
            bytes.len()
        );
    }
    for position in 0..bytes.len() {
        for flip in [0x01, 0x80, 0xFF] {
            let mut broken = bytes.clone();
            broken[position] ^= flip;
            // Any answer will do, as long as it is one.
            let _ = decode_exr(&broken);
        }
    }
}

#[test]
fn file_errors_name_the_path() {
    let folder = own_folder();
    let path = folder.join("missing.exr");
    let error = read_exr(&path).unwrap_err();
    assert!(matches!(error, FileError::Read { .. }));
    assert!(error.to_string().starts_with(&path.display().to_string()));

    let error = write_exr(&folder, &sample_image(1, 1)).unwrap_err();
    assert!(matches!(error, FileError::Write { .. }));

    let path = folder.join("broken.exr");
    std::fs::write(&path, b"no picture").unwrap();
    let error = read_exr(&path).unwrap_err();
    assert!(matches!(error, FileError::Decode { .. }));
    assert!(error.to_string().starts_with(&path.display().to_string()));

    let path = folder.join("good.exr");
    let image = sample_image(7, 3);
    write_exr(&path, &image).unwrap();
    assert_eq!(read_exr(&path).unwrap(), image);
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A folder of this test's own.
fn own_folder() -> std::path::PathBuf {
    let folder = std::env::temp_dir().join(format!("caustics-filter-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a writable folder for temporary files");
    folder
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_picture_comes_back(
        width in 1_u32..40, height in 1_u32..40, bits in any::<[u32; 7]>(),
    ) {
        let pixels = (0..(width * height) as usize)
            .map(|i| [0, 1, 2].map(|c| f32::from_bits(bits[(3 * i + c) % 7])))
            .map(|pixel| pixel.map(|value| if value.is_nan() { 0.0 } else { value }))
            .collect();
        let image = Image::from_pixels(width, height, pixels).unwrap();
        prop_assert_eq!(decode_exr(&encode_exr(&image).unwrap()).unwrap(), image);
    }
}
