//! Pictures, error maps, and what each technique finds.

use super::super::outcome::Outcome;
use crate::study::html::note;
use crate::study::number::significant;
use crate::study::picture::{Frame, Gallery, Layer, LogScale, png};
use luz_image::{Image, ImageError, ToneMap};

/// How many decades the false colours of errors span.
const ERROR_DECADES: f32 = 2.5;

/// Layers of the gallery, and the channels of the film that they show.
const TECHNIQUE_LAYERS: [(&str, &str); 4] = [
    ("BSDF’s share", "BsdfWeighted"),
    ("Light’s share", "LightWeighted"),
    ("BSDF alone", "BsdfAlone"),
    ("Light alone", "LightAlone"),
];

const TECHNIQUE_KEY: &str = "What each technique of finding light contributes: its share is weighted by the heuristic, and both shares sum \
    to the picture; alone, it is weighted by one, and estimates all the light that the technique can find. Light that is seen directly or \
    through specular scattering is the BSDF’s.";

impl Outcome {
    pub(super) fn pictures(&self, tone_map: ToneMap) -> Result<String, ImageError> {
        let [width, height] = self.target.size;
        let image = |pixels: Vec<f32>| Image::from_data(width, height, ["R", "G", "B"], pixels);
        let layer = |name: &str, source: String| Layer { name: name.to_owned(), source };
        let scale = LogScale::of(self.variants.iter().flat_map(|v| &v.pictures.relative_errors), ERROR_DECADES);
        let target = self.target.mean.iter().flatten().map(|v| *v as f32).collect();
        let mut frames = vec![Frame {
            name: "reference".to_owned(),
            remark: String::new(),
            layers: vec![layer("Picture", png(&image(target)?, tone_map)?)],
            is_reference: true,
        }];
        for variant in &self.variants {
            let pictures = &variant.pictures;
            let first = pictures.first.iter().flatten().copied().collect();
            let mut layers = vec![
                layer("Picture", png(&image(first)?, tone_map)?),
                layer("Error", scale.png(width, height, &pictures.relative_errors)?),
            ];
            if let Some(techniques) = &pictures.techniques {
                for (name, channels) in TECHNIQUE_LAYERS {
                    if let Ok(selected) = techniques
                        .select(&["R", "G", "B"].map(|c| format!("{channels}.{c}")).each_ref().map(String::as_str))
                    {
                        layers.push(layer(name, png(&image(selected.into_data())?, tone_map)?));
                    }
                }
            }
            let mse = variant.summary.mse.map_or("–".to_owned(), |i| significant(i.value, 2));
            let remark = format!("MSE {mse} · {} samples", significant(variant.summary.samples, 3));
            frames.push(Frame { name: variant.name.clone(), remark, layers, is_reference: false });
        }
        let error_key = scale.key("Each pixel's relative error, |x − r| / √(r² + 0.01), as the root of its mean square over seeds and channels; one scale for all variants.")?;
        let technique_key = note(TECHNIQUE_KEY);
        let keys = [("Error".to_owned(), error_key)]
            .into_iter()
            .chain(TECHNIQUE_LAYERS.iter().map(|(name, _)| ((*name).to_owned(), technique_key.clone())));
        let first_seed = note("Pictures are those of the first seed, at the end of its time.");
        Ok(Gallery { width, height, frames, keys: keys.collect() }.html() + &first_seed)
    }
}
