use std::io::Cursor;
use std::path::Path;

use exr::image::{Encoding, Image as ExrImage, SpecificChannels};
use exr::math::Vec2;
use exr::meta::MetaData;
use exr::meta::attribute::Text;
use exr::meta::header::Header;
use exr::prelude::{
    Blocks, Compression, LineOrder, ReadChannels, ReadLayers, ReadSpecificChannel, WritableImage,
    read,
};

use crate::{DecodeError, EncodeError, FileError, Image, ImageError};

/// Encodes an image as `OpenEXR`: 32-bit float channels R, G and B, scan lines, ZIP compression.
///
/// Lossless, NaNs and infinities included. The same image gives the same bytes on any number of
/// threads; no date and no name is written.
///
/// # Errors
///
/// Where the encoder refuses the image.
///
/// ```
/// use caustics_filter::{Image, decode_exr, encode_exr};
///
/// let image = Image::from_pixels(2, 1, vec![[0.5, 1e-30, 7e4], [0.0, -1.0, 3.0]])?;
/// assert_eq!(decode_exr(&encode_exr(&image)?)?, image);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn encode_exr(image: &Image) -> Result<Vec<u8>, EncodeError> {
    let (width, pixels) = (image.width() as usize, image.pixels());
    let channels = SpecificChannels::rgb(|position: Vec2<usize>| {
        let [red, green, blue] = pixels[position.y() * width + position.x()];
        (red, green, blue)
    });
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let size = (width, image.height() as usize);
    let mut bytes = Cursor::new(Vec::new());
    ExrImage::from_encoded_channels(size, encoding, channels)
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)
        .map_err(|error| EncodeError::Refused {
            reason: error.to_string(),
        })?;
    Ok(bytes.into_inner())
}

/// Decodes `OpenEXR` bytes: the first layer that has channels R, G and B.
///
/// Half, float and integer samples, any compression but the deep and the lossy DWA ones, scan
/// lines or tiles (largest level). A layer's or view's prefix before the last point of the names
/// (`Beauty.R`) is accepted; alpha and all other channels are ignored. The image is that of the
/// data window. NaNs and infinities are kept.
///
/// # Errors
///
/// Bytes that are not `OpenEXR`, are cut short or unsupported, have no RGB channels, or more
/// pixels than an [`Image`] may have.
pub fn decode_exr(bytes: &[u8]) -> Result<Image, DecodeError> {
    let malformed = |error: exr::error::Error| DecodeError::Malformed {
        reason: error.to_string(),
    };
    let headers = MetaData::read_from_buffered(Cursor::new(bytes), false)
        .map_err(malformed)?
        .headers;
    let Some((header, [red, green, blue])) = headers
        .iter()
        .find_map(|header| Some((header, color_channels(header)?)))
    else {
        let names: Vec<_> = headers.iter().flat_map(channel_names).take(32).collect();
        return Err(DecodeError::NoColor {
            channels: names.join(", "),
        });
    };
    // The decoder would put the samples of such a channel in the wrong places.
    if let Some(channel) = header
        .channels
        .list
        .iter()
        .find(|c| c.sampling != Vec2(1, 1))
    {
        let reason = format!(
            "channel {} is subsampled, which is not supported",
            channel.name
        );
        return Err(DecodeError::Malformed { reason });
    }
    let side = |length: usize| u32::try_from(length).unwrap_or(u32::MAX);
    let (width, height) = (
        side(header.layer_size.width()),
        side(header.layer_size.height()),
    );
    // Before the decoder asks for the memory.
    Image::check_size(width, height)?;

    let decoded = read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required(red)
        .required(green)
        .required(blue)
        .collect_pixels(
            move |_, _| Image::new(width, height),
            |image: &mut Result<Image, ImageError>,
             position,
             (red, green, blue): (f32, f32, f32)| {
                let (x, y) = (position.x() as u32, position.y() as u32);
                if let Some(pixel) = image.as_mut().ok().and_then(|image| image.pixel_mut(x, y)) {
                    *pixel = [red, green, blue];
                }
            },
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(malformed)?;
    Ok(decoded.layer_data.channel_data.pixels?)
}

/// Reads an `OpenEXR` file, as [`decode_exr`] does.
///
/// # Errors
///
/// Where the file cannot be read or decoded; the message names it.
pub fn read_exr(path: impl AsRef<Path>) -> Result<Image, FileError> {
    let path = path.as_ref();
    let bytes = std::fs::read(path).map_err(|source| FileError::Read {
        path: path.to_owned(),
        source,
    })?;
    decode_exr(&bytes).map_err(|source| FileError::Decode {
        path: path.to_owned(),
        source,
    })
}

/// Writes an `OpenEXR` file, as [`encode_exr`] does.
///
/// # Errors
///
/// Where the image cannot be encoded or the file not written; the message names it.
pub fn write_exr(path: impl AsRef<Path>, image: &Image) -> Result<(), FileError> {
    let path = path.as_ref();
    let bytes = encode_exr(image).map_err(|source| FileError::Encode {
        path: path.to_owned(),
        source,
    })?;
    std::fs::write(path, bytes).map_err(|source| FileError::Write {
        path: path.to_owned(),
        source,
    })
}

fn channel_names(header: &Header) -> impl Iterator<Item = String> {
    header
        .channels
        .list
        .iter()
        .map(|channel| channel.name.to_string())
}

/// The names of a layer's channels R, G and B: the plain ones where there are some.
fn color_channels(header: &Header) -> Option<[Text; 3]> {
    let named = |name: &str| {
        let mut channels = header.channels.list.iter();
        channels
            .find(|channel| channel.name.to_string() == name)
            .map(|found| found.name.clone())
    };
    let mut prefixes: Vec<String> = channel_names(header)
        .filter_map(|name| name.strip_suffix('R').map(str::to_owned))
        .filter(|prefix| prefix.is_empty() || prefix.ends_with('.'))
        .collect();
    prefixes.sort_by_key(String::len);
    prefixes.iter().find_map(|prefix| {
        let [red, green, blue] = ["R", "G", "B"].map(|last| named(&format!("{prefix}{last}")));
        Some([red?, green?, blue?])
    })
}
