//! Files that chance broke: an error or a warning in one line, never a panic, a hang, or a great allocation.

use crate::writer;

use caustics_scene::World;
use caustics_scene::gltf::load_slice;
use proptest::prelude::*;
use serde_json::{Value, json};
use writer::rich_file;

/// Loads whatever it is, checks the message, and flattens what loads.
pub(crate) fn survive(bytes: &[u8]) -> Result<(), String> {
    match load_slice(bytes, None) {
        Ok(loaded) => {
            for warning in &loaded.warnings {
                assert_eq!(warning.to_string().lines().count(), 1, "{warning}");
            }
            World::new(&loaded.scene)
                .map(|_| ())
                .map_err(|error| error.to_string())
        }
        Err(error) => {
            let message = error.to_string();
            assert_eq!(message.lines().count(), 1, "{message:?}");
            assert!(message.len() < 1000, "{message}");
            Err(message)
        }
    }
}

#[test]
fn every_prefix_of_a_file_is_an_error() {
    let bytes = rich_file().glb();
    assert_eq!(survive(&bytes), Ok(()));
    for length in 0..bytes.len() {
        assert!(
            survive(&bytes[..length]).is_err(),
            "{length} of {} bytes",
            bytes.len()
        );
    }
}

#[test]
fn every_prefix_of_a_text_file_is_an_error() {
    let file = rich_file();
    let uri = format!("data:;base64,{}", writer::base64(&file.bin));
    let text = file.text(Some(&uri));
    assert_eq!(survive(text.as_bytes()), Ok(()));
    for length in 0..text.len() {
        assert!(
            survive(&text.as_bytes()[..length]).is_err(),
            "{length} of {} bytes",
            text.len()
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn random_bytes_in_a_file(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)
    ) {
        let mut bytes = rich_file().glb();
        for (place, value) in changes {
            let place = place.index(bytes.len());
            bytes[place] = value;
        }
        let _ = survive(&bytes);
    }

    #[test]
    fn random_numbers_in_the_json(
        changes in prop::collection::vec((any::<prop::sample::Index>(), 0usize..12), 1..4)
    ) {
        let mut file = rich_file();
        file.root["buffers"] = json!([{ "byteLength": file.bin.len() }]);
        for (place, value) in changes {
            let mut count = 0;
            visit_numbers(&mut file.root, &mut |_| count += 1);
            let place = place.index(count);
            let mut number = 0;
            visit_numbers(&mut file.root, &mut |slot| {
                if number == place {
                    *slot = strange_value(value);
                }
                number += 1;
            });
        }
        let _ = survive(&file.glb());
    }

    #[test]
    fn bytes_that_are_no_file(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let _ = survive(&bytes);
        let mut behind_magic = b"glTF\x02\0\0\0".to_vec();
        behind_magic.extend(&bytes);
        let _ = survive(&behind_magic);
    }
}

fn strange_value(choice: usize) -> Value {
    [
        json!(0),
        json!(1),
        json!(-1),
        json!(255),
        json!(4_294_967_295u32),
        json!(4_294_967_296u64),
        json!(u64::MAX),
        json!(i64::MIN),
        json!(1e300),
        json!(-1e-300),
        json!(0.5),
        json!("x"),
    ][choice]
        .clone()
}

fn visit_numbers(value: &mut Value, visit: &mut impl FnMut(&mut Value)) {
    match value {
        Value::Number(_) => visit(value),
        Value::Array(list) => list.iter_mut().for_each(|item| visit_numbers(item, visit)),
        Value::Object(map) => map.values_mut().for_each(|item| visit_numbers(item, visit)),
        _ => {}
    }
}
