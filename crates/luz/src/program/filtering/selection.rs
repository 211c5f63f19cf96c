//! Which channels are worked on, and what becomes of the others.

use luz::image::{Image, ImageError};

/// The channels that are filtered of an image, and the image that they came from if there are others.
pub struct Selection {
    /// The channels that are filtered.
    pub image: Image,
    rest: Option<Image>,
}

impl Selection {
    /// The channels of these names or layers; the colour with its opacity where there are no names, all channels where there
    /// is no colour.
    pub fn new(image: Image, names: &[String]) -> Result<Self, ImageError> {
        let wanted = if names.is_empty() { color(&image) } else { expand(&image, names)? };
        if wanted == image.channels() {
            return Ok(Self { image, rest: None });
        }
        let names: Vec<&str> = wanted.iter().map(String::as_str).collect();
        Ok(Self { image: image.select(&names)?, rest: Some(image) })
    }

    /// Takes the channels out, to be worked on; [`Rest::put_back`] adds the others.
    pub fn into_parts(self) -> (Image, Rest) {
        (self.image, Rest(self.rest))
    }
}

/// What isn't worked on.
pub struct Rest(Option<Image>);

impl Rest {
    /// The whole image, with new samples in the channels that were worked on.
    pub fn put_back(self, part: Image) -> Image {
        let Some(mut whole) = self.0 else { return part };
        let positions: Vec<Option<usize>> = part.channels().iter().map(|name| whole.channel(name)).collect();
        let (n, m) = (whole.channel_count(), part.channel_count());
        whole.metadata = part.metadata.clone();
        for (to, from) in whole.data_mut().chunks_exact_mut(n).zip(part.data().chunks_exact(m)) {
            for (position, value) in positions.iter().zip(from) {
                if let Some(position) = position {
                    to[*position] = *value;
                }
            }
        }
        whole
    }
}

/// The names of the colour's channels with opacity, or of all channels.
pub fn color(image: &Image) -> Vec<String> {
    let colors: &[&str] = match image.rgb() {
        Some([r, g, _]) if r != g => &["R", "G", "B", "A"],
        Some(_) => &["Y", "A"],
        None => return image.channels().to_vec(),
    };
    image.channels().iter().filter(|c| colors.contains(&c.as_str())).cloned().collect()
}

/// The channels that names of channels or layers stand for, each once, in the order of the names.
pub fn expand(image: &Image, names: &[String]) -> Result<Vec<String>, ImageError> {
    let mut found: Vec<String> = Vec::new();
    for name in names {
        let layer = format!("{name}.");
        let before = found.len();
        let matching = image.channels().iter().filter(|c| *c == name || c.starts_with(&layer));
        let new: Vec<String> = matching.filter(|c| !found.contains(c)).cloned().collect();
        let is_known = !new.is_empty() || found.iter().any(|c| c == name || c.starts_with(&layer));
        found.extend(new);
        if found.len() == before && !is_known {
            return Err(ImageError::NoSuchChannel { name: name.clone(), known: image.channels().to_vec() });
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn others_come_back_untouched() {
        let channels = ["R", "G", "B", "Z", "Ns.X", "Ns.Y"];
        let image = Image::from_data(1, 2, channels, (0..12).map(|i| i as f32).collect()).unwrap();
        let (mut part, rest) = Selection::new(image.clone(), &[]).unwrap().into_parts();
        assert_eq!(part.channels(), ["R", "G", "B"]);
        part.data_mut().iter_mut().for_each(|v| *v += 100.0);
        let whole = rest.put_back(part);
        assert_eq!(whole.pixel(0, 1), [106.0, 107.0, 108.0, 9.0, 10.0, 11.0]);
        let names = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
        assert_eq!(expand(&image, &names(&["Ns", "Z", "Ns.X"])).unwrap(), ["Ns.X", "Ns.Y", "Z"]);
        assert!(expand(&image, &names(&["N"])).is_err());
        let layers = Image::from_data(1, 1, ["a", "b"], vec![0.0, 1.0]).unwrap();
        assert_eq!(Selection::new(layers, &[]).unwrap().image.channels(), ["a", "b"]);
    }
}
