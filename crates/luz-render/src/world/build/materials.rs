//! Materials out of a scene's descriptions of them.

use super::textures::TextureBuilder;
use super::{Context, unsupported};
use crate::bsdf::{CoatInterface, TrowbridgeReitz};
use crate::material::{Coat, Material, MaterialId, Metal, NormalMap, Perturbation, Refraction, Roughness, Scattering};
use crate::texture::{SpectrumKind, SpectrumTexture, TexelFilter};
use luz_color::{Spectrum, named_spectrum};
use luz_image::{Encoding, WrapMode};
use luz_scene::{Diagnostic, Entity};

/// Makes the material of an entity.
pub(super) fn material(context: &mut Context<'_>, textures: &mut TextureBuilder, entity: &Entity) -> Material {
    let half = || Spectrum::Constant(0.5);
    let scattering = match &*entity.kind {
        "diffuse" => Scattering::Diffuse {
            reflectance: textures.spectrum(context, entity, "reflectance", SpectrumKind::Albedo, half),
        },
        "diffusetransmission" => {
            let quarter = || Spectrum::Constant(0.25);
            Scattering::DiffuseTransmission {
                reflectance: textures.spectrum(context, entity, "reflectance", SpectrumKind::Albedo, quarter),
                transmittance: textures.spectrum(context, entity, "transmittance", SpectrumKind::Albedo, quarter),
                scale: entity.parameters.one_float("scale", 1.0, context.diagnostics),
            }
        }
        "conductor" => Scattering::Conductor {
            metal: metal(context, textures, entity, ["eta", "k", "reflectance"]),
            roughness: roughness(context, textures, entity, ""),
        },
        "dielectric" => Scattering::Dielectric {
            refraction: refraction(context, entity, "eta"),
            roughness: roughness(context, textures, entity, ""),
        },
        "thindielectric" => Scattering::ThinDielectric { refraction: refraction(context, entity, "eta") },
        "coateddiffuse" => {
            let reflectance = textures.spectrum(context, entity, "reflectance", SpectrumKind::Albedo, half);
            let mut coat = coat(context, textures, entity, "", "eta");
            coat.interface = interface(textures, &coat);
            Scattering::CoatedDiffuse { reflectance, coat }
        }
        "coatedconductor" => Scattering::CoatedConductor {
            metal: metal(context, textures, entity, ["conductor.eta", "conductor.k", "reflectance"]),
            roughness: roughness(context, textures, entity, "conductor."),
            coat: coat(context, textures, entity, "interface.", "interface.eta"),
        },
        "mix" => mix(context, textures, entity),
        "interface" | "" | "none" => Scattering::Interface,
        _ => {
            unsupported(context, entity, "material");
            Scattering::Interface
        }
    };
    Material { scattering, perturbation: perturbation(context, textures, entity) }
}

fn mix(context: &mut Context<'_>, textures: &mut TextureBuilder, entity: &Entity) -> Scattering {
    let amount = textures.float(context, entity, "amount", 0.5);
    let names = entity.parameters.strings("materials", context.diagnostics).unwrap_or_default();
    let [first, second] = names else {
        context.diagnostics.push(
            Diagnostic::error(
                entity.parameters.span("materials").unwrap_or(entity.kind_span),
                format!("a `mix` is made of two materials, not {}", names.len()),
            )
            .with_help("name them: `\"string materials\" [ \"a\" \"b\" ]`"),
        );
        return Scattering::Interface;
    };
    let mut find = |name: &str| match context.description.material_index(name) {
        Some(index) => MaterialId(index as u32),
        None => {
            let span = entity.parameters.span("materials");
            context.diagnostics.error(span, format!("no material is named `{name}`"));
            MaterialId(0)
        }
    };
    Scattering::Mix { materials: [find(first), find(second)], amount }
}

fn perturbation(context: &mut Context<'_>, textures: &mut TextureBuilder, entity: &Entity) -> Option<Perturbation> {
    let displacement = textures.optional_float(context, entity, "displacement");
    let normal_map = entity.parameters.string("normalmap", context.diagnostics).and_then(|name| {
        let path = context.description.resolve(name);
        let span = entity.parameters.span("normalmap");
        let sampling = (WrapMode::Repeat, TexelFilter::Bilinear);
        let colors = textures.images.colors(
            &path,
            Some(Encoding::Linear),
            sampling,
            SpectrumKind::Unbounded,
            span,
            context.diagnostics,
        )?;
        Some(NormalMap { pyramid: colors.pyramid })
    });
    match (displacement, normal_map) {
        (Some(_), Some(_)) => {
            context.diagnostics.push(
                Diagnostic::error(
                    entity.parameters.span("normalmap"),
                    "both a displacement and a normal map are given",
                )
                .with_help("a material takes one of them"),
            );
            None
        }
        (Some(texture), None) => Some(Perturbation::Displacement(texture)),
        (None, Some(map)) => Some(Perturbation::NormalMap(map)),
        (None, None) => None,
    }
}

fn roughness(context: &mut Context<'_>, textures: &mut TextureBuilder, entity: &Entity, prefix: &str) -> Roughness {
    let both = textures.float(context, entity, &format!("{prefix}roughness"), 0.0);
    let mut along = |name: &str| textures.optional_float(context, entity, &format!("{prefix}{name}")).unwrap_or(both);
    let along = [along("uroughness"), along("vroughness")];
    Roughness { along, remap: entity.parameters.one_bool("remaproughness", true, context.diagnostics) }
}

fn refraction(context: &mut Context<'_>, entity: &Entity, name: &str) -> Refraction {
    // An index may be given as a number or as a spectrum.
    let Some(parameter) = entity.parameters.get(name) else { return Refraction::Constant(1.5) };
    if !parameter.kind.is_spectrum() {
        let eta = entity.parameters.one_float(name, 1.5, context.diagnostics);
        if eta.is_nan() || eta <= 0.0 {
            let span = entity.parameters.span(name);
            context.diagnostics.error(span, format!("an index of refraction must be positive, not {eta}"));
            return Refraction::Constant(1.5);
        }
        return Refraction::Constant(eta);
    }
    let spectrum =
        super::spectra::optional_spectrum(&entity.parameters, name, SpectrumKind::Unbounded, context.diagnostics)
            .unwrap_or(Spectrum::Constant(1.5));
    match spectrum {
        Spectrum::Constant(eta) => Refraction::Constant(eta),
        spectrum => Refraction::Dispersive(spectrum),
    }
}

/// Optical constants, by the names of their parameters: η, k, reflectance.
fn metal(context: &mut Context<'_>, textures: &mut TextureBuilder, entity: &Entity, names: [&str; 3]) -> Metal {
    let [eta, k, reflectance] = names;
    let given = |name: &str| entity.parameters.contains(name);
    if given(reflectance) {
        if given(eta) || given(k) {
            context.diagnostics.push(
                Diagnostic::error(
                    entity.parameters.span(reflectance),
                    format!("both `{reflectance}` and `{eta}` or `{k}` are given"),
                )
                .with_help("a metal is described by its reflectance or by its optical constants"),
            );
        }
        let black = || Spectrum::Constant(0.0);
        return Metal::Reflectance(textures.spectrum(context, entity, reflectance, SpectrumKind::Albedo, black));
    }
    let copper = |name: &'static str| move || named_spectrum(name).unwrap_or(Spectrum::Constant(1.0));
    Metal::Measured {
        eta: textures.spectrum(context, entity, eta, SpectrumKind::Unbounded, copper("metal-Cu-eta")),
        k: textures.spectrum(context, entity, k, SpectrumKind::Unbounded, copper("metal-Cu-k")),
    }
}

fn coat(
    context: &mut Context<'_>,
    textures: &mut TextureBuilder,
    entity: &Entity,
    prefix: &str,
    eta_name: &str,
) -> Coat {
    let roughness = roughness(context, textures, entity, prefix);
    let refraction = refraction(context, entity, eta_name);
    let thickness =
        textures.float(context, entity, if prefix.is_empty() { "thickness" } else { "interface.thickness" }, 0.01);
    let black = || Spectrum::Constant(0.0);
    let albedo = textures.spectrum(context, entity, "albedo", SpectrumKind::Albedo, black);
    let g = textures.float(context, entity, "g", 0.0);
    let diagnostics = &mut *context.diagnostics;
    let mut positive = |name: &str, default: i32| {
        let value = entity.parameters.one_integer(name, default, diagnostics);
        if value < 1 {
            diagnostics.error(entity.parameters.span(name), format!("`{name}` must be at least 1, not {value}"));
        }
        value.max(1) as u32
    };
    Coat {
        roughness,
        refraction,
        thickness,
        albedo,
        g,
        max_depth: positive("maxdepth", 10),
        samples: positive("nsamples", 1),
        weights: context.coat_weights,
        interface: None,
    }
}

/// The tables of the closed form, where it holds.
fn interface(textures: &TextureBuilder, coat: &Coat) -> Option<Box<CoatInterface>> {
    let textures = &textures.textures;
    let Refraction::Constant(eta) = coat.refraction else { return None };
    let thickness = textures.constant_float(coat.thickness)?;
    let clear = match textures.spectrum_texture(coat.albedo) {
        SpectrumTexture::Constant(spectrum) => spectrum.is_black(),
        _ => false,
    };
    if !clear {
        return None;
    }
    let alpha = |i: usize| {
        let roughness = textures.constant_float(coat.roughness.along[i])?;
        Some(if coat.roughness.remap { TrowbridgeReitz::roughness_to_alpha(roughness) } else { roughness })
    };
    let interface = match (alpha(0), alpha(1)) {
        (Some(x), Some(y)) => CoatInterface::new(x, y, eta, thickness, coat.max_depth),
        _ => CoatInterface::textured(eta, thickness, coat.max_depth),
    };
    Some(Box::new(interface.with_weights(coat.weights)))
}
