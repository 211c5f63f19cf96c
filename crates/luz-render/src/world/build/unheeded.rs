//! What a scene asks for and this renderer does not heed: said, never skipped in silence.

use super::{Context, unsupported};
use luz_scene::{Diagnostic, Entity};
use std::collections::BTreeSet;

/// Reports media, options and parameters that are understood but not heeded.
pub(super) fn report(context: &mut Context<'_>) {
    media(context);
    options(context);
    parameters(context);
}

/// One error for each medium that something stands in.
fn media(context: &mut Context<'_>) {
    let description = context.description;
    let objects = description.objects.iter().flat_map(|object| &object.shapes);
    let of_shapes = description.shapes.iter().chain(objects).flat_map(|s| [s.inside_medium, s.outside_medium]);
    let of_lights = description.lights.iter().map(|light| light.outside_medium);
    let used: BTreeSet<usize> = of_shapes.chain(of_lights).chain([description.camera.medium]).flatten().collect();
    for medium in used {
        unsupported(context, &description.media[medium].entity, "medium");
    }
}

fn options(context: &mut Context<'_>) {
    let options = &context.description.options;
    let switches = [
        ("disablepixeljitter", options.disable_pixel_jitter),
        ("disabletexturefiltering", options.disable_texture_filtering),
        ("disablewavelengthjitter", options.disable_wavelength_jitter),
        ("forcediffuse", options.force_diffuse),
        ("pixelstats", options.pixel_stats),
    ];
    let given = switches.iter().filter_map(|(name, option)| option.filter(|o| o.value).map(|o| (*name, o.span)));
    let files = [
        ("msereferenceimage", options.mse_reference_image.as_ref().map(|o| o.span)),
        ("msereferenceout", options.mse_reference_out.as_ref().map(|o| o.span)),
    ];
    for (name, span) in given.chain(files.into_iter().filter_map(|(name, span)| Some((name, span?)))) {
        context.diagnostics.warning(span, format!("the option `{name}` is not heeded"));
    }
}

fn parameters(context: &mut Context<'_>) {
    let description = context.description;
    let mut warn = |entity: &Entity, name: &str, message: &str, help: &str| {
        let span = entity.parameters.span(name).unwrap_or(entity.kind_span);
        context.diagnostics.push(Diagnostic::warning(span, message).with_help(help));
    };
    let mut ignored = luz_scene::Diagnostics::default();
    let text = |entity: &Entity, name: &str, default: &'static str, sink: &mut luz_scene::Diagnostics| {
        entity.parameters.one_string(name, default, sink).to_owned()
    };
    if &*description.film.kind == "gbuffer"
        && text(&description.film, "coordinatesystem", "camera", &mut ignored) != "world"
    {
        warn(
            &description.film,
            "coordinatesystem",
            "positions and normals are written in world space",
            "say `\"string coordinatesystem\" \"world\"` if that is what you want",
        );
    }
    let randomization = text(&description.sampler, "randomization", "fastowen", &mut ignored);
    if randomization == "none" {
        let help = "each sampler has its own randomization, without which errors would be patterns";
        warn(&description.sampler, "randomization", "samples are randomized all the same", help);
    }
    if !description.sampler.parameters.one_bool("jitter", true, &mut ignored) {
        let help = "stratified samples are drawn at random within their strata";
        warn(&description.sampler, "jitter", "samples are jittered all the same", help);
    }
}
