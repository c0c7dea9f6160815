//! PNG bytes, read back with a decoder.

use std::io::Cursor;

use caustics_filter::{Display, FileError, Image, ToneCurve, encode_png, write_png};

fn decode(bytes: &[u8]) -> (u32, u32, Vec<u8>) {
    let mut reader = png::Decoder::new(Cursor::new(bytes))
        .read_info()
        .expect("a header");
    assert!(
        reader.info().srgb.is_some(),
        "the file says that it is sRGB"
    );
    let mut samples = vec![0; reader.output_buffer_size().expect("a size")];
    let frame = reader.next_frame(&mut samples).expect("a picture");
    assert_eq!(
        (frame.color_type, frame.bit_depth),
        (png::ColorType::Rgb, png::BitDepth::Eight)
    );
    (frame.width, frame.height, samples)
}

#[test]
fn pixels_are_those_of_the_display() {
    let pixels: Vec<_> = (0..35)
        .map(|i| [i as f32 / 20.0, 0.5, (34 - i) as f32 / 34.0])
        .collect();
    let image = Image::from_pixels(7, 5, pixels.clone()).unwrap();
    for display in [
        Display::default(),
        Display {
            exposure_ev: 1.5,
            curve: ToneCurve::Clamp,
        },
        Display {
            exposure_ev: -0.5,
            curve: ToneCurve::Reinhard { white: 3.0 },
        },
    ] {
        let bytes = encode_png(&image, &display).unwrap();
        let expected: Vec<u8> = pixels
            .iter()
            .flat_map(|&pixel| display.encode(pixel))
            .collect();
        assert_eq!(decode(&bytes), (7, 5, expected));
        assert!(encode_png(&image, &display).unwrap() == bytes);
    }
}

#[test]
fn an_unwritable_path_is_named() {
    let folder = std::env::temp_dir();
    let error = write_png(&folder, &Image::new(1, 1).unwrap(), &Display::default()).unwrap_err();
    assert!(matches!(error, FileError::Write { .. }));
    assert!(error.to_string().starts_with(&folder.display().to_string()));
}
