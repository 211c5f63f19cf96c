//! The guides of a command line: channels of the input, other images, other videos.

use super::arguments::FilterArguments;
use super::failure::Failure;
use super::job::video_options;
use super::selection;
use super::values::{GuideArgument, ScaleName};
use luz::filter::{Distance, Range, Scale, VideoGuide};
use luz::image::video::{VideoKind, VideoReader};
use luz::image::{Image, ReadOptions};

/// All guides of a command.
pub struct Guides(Vec<Source>);

struct Source {
    argument: GuideArgument,
    range: Range,
    scale: Option<ScaleName>,
    frames: Frames,
}

enum Frames {
    /// The input's own.
    Own,
    /// The same image for all frames.
    Still(Box<Image>),
    /// A video beside that of the input.
    Video(Box<VideoReader>),
}

impl Guides {
    /// Opens all guides.
    pub fn open(arguments: &FilterArguments, is_video: bool) -> Result<Self, Failure> {
        let mut sources = Vec::new();
        for argument in &arguments.guide {
            let frames = match &argument.file {
                None => Frames::Own,
                Some(file) if VideoKind::from_path(file).is_none() => {
                    Frames::Still(Box::new(Image::read_with(file, &ReadOptions::stored())?))
                }
                Some(file) if is_video => {
                    Frames::Video(Box::new(VideoReader::open(file, &video_options(&arguments.files))?))
                }
                Some(file) => {
                    let problem = format!("the guide `{}` is a video, but the input is one image", file.display());
                    return Err(Failure::Usage(problem));
                }
            };
            let sigma = argument.sigma.unwrap_or(arguments.sigma_range);
            let range = Range { sigma, distance: arguments.distance.into(), scale: Scale::Linear };
            sources.push(Source { argument: argument.clone(), range, scale: arguments.scale, frames });
        }
        Ok(Self(sources))
    }

    /// The guides of the next frame, which is this: all of its channels, stored values.
    pub fn next(&mut self, frame: &Image) -> Result<Vec<VideoGuide>, Failure> {
        self.0.iter_mut().map(|source| source.next(frame)).collect()
    }
}

impl Source {
    fn next(&mut self, frame: &Image) -> Result<VideoGuide, Failure> {
        let read;
        let whole = match &mut self.frames {
            Frames::Own => frame,
            Frames::Still(image) => image,
            Frames::Video(reader) => {
                let ended = || Failure::Input(format!("the guide `{}` has fewer frames", reader_name(&self.argument)));
                read = reader.read()?.ok_or_else(ended)?;
                &read
            }
        };
        let names = if self.argument.channels.is_empty() {
            // Opacity is no likeness.
            selection::color(whole).into_iter().filter(|c| c != "A" || whole.channel_count() == 1).collect()
        } else {
            selection::expand(whole, &self.argument.channels)?
        };
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let mut image = whole.select(&names)?;
        let mut range = self.range;
        // Normals, depths and the like have no colour to be distant in.
        if range.distance == Distance::DeltaE && image.rgb().is_none_or(|[r, g, _]| r == g) {
            range.distance = Distance::L2;
        }
        (range.scale, _) = prepare(&mut image, self.scale, range.distance);
        Ok(VideoGuide { image, range, widths: None })
    }
}

fn reader_name(argument: &GuideArgument) -> String {
    argument.file.as_ref().map_or_else(String::new, |file| file.display().to_string())
}

/// Decodes stored values where that is needed, and says on which scales the filter is to compare and to average.
pub fn prepare(image: &mut Image, scale: Option<ScaleName>, distance: Distance) -> (Scale, Scale) {
    let is_encoded = image.metadata.stored_encoding.is_some();
    match (scale, distance) {
        // Compared and averaged as stored.
        (None, Distance::L1 | Distance::L2) => (Scale::Linear, Scale::Linear),
        (Some(ScaleName::Encoded), Distance::L1 | Distance::L2) if is_encoded => (Scale::Linear, Scale::Linear),
        // Colour differences are those of light; what is averaged stays as it is stored.
        (scale, _) => {
            image.decode_stored();
            let scale = match scale {
                Some(scale) => scale.into(),
                None if is_encoded => Scale::Encoded,
                None => Scale::Linear,
            };
            (scale, scale)
        }
    }
}
