use std::path::Path;

use crate::{Display, EncodeError, FileError, Image};

/// Encodes an image as an 8-bit sRGB PNG, as `display` shows it.
///
/// # Errors
///
/// Where the encoder refuses the image.
///
/// ```
/// use caustics_filter::{Display, Image, encode_png};
///
/// let image = Image::new(4, 3)?;
/// let bytes = encode_png(&image, &Display::default())?;
/// assert_eq!(bytes[1..4], *b"PNG");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn encode_png(image: &Image, display: &Display) -> Result<Vec<u8>, EncodeError> {
    let samples: Vec<u8> = image
        .pixels()
        .iter()
        .flat_map(|&pixel| display.encode(pixel))
        .collect();
    let refused = |error: png::EncodingError| EncodeError::Refused {
        reason: error.to_string(),
    };
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, image.width(), image.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    let mut writer = encoder.write_header().map_err(refused)?;
    writer.write_image_data(&samples).map_err(refused)?;
    writer.finish().map_err(refused)?;
    Ok(bytes)
}

/// Writes an 8-bit sRGB PNG file, as `display` shows the image.
///
/// # Errors
///
/// Where the image cannot be encoded or the file not written; the message names it.
pub fn write_png(
    path: impl AsRef<Path>,
    image: &Image,
    display: &Display,
) -> Result<(), FileError> {
    let path = path.as_ref();
    let bytes = encode_png(image, display).map_err(|source| FileError::Encode {
        path: path.to_owned(),
        source,
    })?;
    std::fs::write(path, bytes).map_err(|source| FileError::Write {
        path: path.to_owned(),
        source,
    })
}
