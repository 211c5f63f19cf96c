//! What pbrt-v3 called things, and what they are in pbrt-v4.

use crate::schema::Category;

/// Said once for a scene in which old syntax was found.
pub(crate) const UPGRADE_HINT: &str =
    "this looks like a pbrt-v3 scene; pbrt-v4's own converter is `pbrt --upgrade old.pbrt > new.pbrt`";

/// A directive of pbrt-v3 (or v2).
pub(crate) fn directive(name: &[u8]) -> Option<&'static str> {
    Some(match name {
        b"WorldEnd" => "pbrt-v4 scenes have no `WorldEnd`: remove it",
        b"SurfaceIntegrator" | b"VolumeIntegrator" | b"Renderer" => "this is pbrt-v2; pbrt-v4 has `Integrator`",
        b"Volume" => "this is pbrt-v2; pbrt-v4 has `MakeNamedMedium` and `MediumInterface`",
        b"SearchPath" | b"PixelFilterBegin" => "this is not part of pbrt-v4",
        _ => return None,
    })
}

/// A parameter type of pbrt-v3: the type in pbrt-v4 to read it as, and what to write.
pub(crate) fn parameter_type(name: &str) -> Option<(&'static str, &'static str)> {
    Some(match name {
        "color" => ("rgb", "pbrt-v3's `color` is `rgb` in pbrt-v4"),
        "point" => ("point3", "pbrt-v3's `point` is `point3` in pbrt-v4"),
        "point4" => ("point3", "pbrt-v4 has `point2` and `point3`"),
        "vector" => ("vector3", "pbrt-v3's `vector` is `vector3` in pbrt-v4"),
        "normal3" => ("normal", "it is called `normal`"),
        "xyz" => ("rgb", "pbrt-v4 has no `xyz`; give `rgb` or `spectrum`"),
        "int" => ("integer", "it is called `integer`"),
        "boolean" => ("bool", "it is called `bool`"),
        _ => return None,
    })
}

/// A kind of entity of pbrt-v3.
pub(crate) fn kind(category: Category, name: &str) -> Option<&'static str> {
    use Category::*;
    Some(match (category, name) {
        (Material, "matte") => "pbrt-v3's `matte` is `diffuse` in pbrt-v4, `Kd` is `reflectance`",
        (Material, "plastic" | "substrate") => {
            "pbrt-v3's `plastic` and `substrate` are `coateddiffuse` in pbrt-v4, `Kd` is `reflectance`"
        }
        (Material, "uber") => "pbrt-v4 has no `uber`; nearest is `coateddiffuse` (or `diffuse`, `mix`)",
        (Material, "metal") => "pbrt-v3's `metal` is `conductor` in pbrt-v4",
        (Material, "mirror") => {
            "pbrt-v4 has no `mirror`; write `conductor` with \"float roughness\" 0 and \"rgb reflectance\""
        }
        (Material, "glass") => "pbrt-v3's `glass` is `dielectric` in pbrt-v4",
        (Material, "translucent") => "pbrt-v3's `translucent` is `diffusetransmission` in pbrt-v4",
        (Material, "kdsubsurface") => "pbrt-v3's `kdsubsurface` is `subsurface` with `reflectance` in pbrt-v4",
        (Material, "disney") => "pbrt-v4 has no `disney`; nearest are `coateddiffuse` and `conductor`",
        (Material, "fourier") => "pbrt-v4 has no `fourier`; it has `measured`",
        (Film, "image") => "pbrt-v3's `image` is `rgb` in pbrt-v4",
        (Sampler, "random") => "pbrt-v3's `random` is `independent` in pbrt-v4",
        (Sampler, "lowdiscrepancy" | "02sequence") => "it is `paddedsobol` in pbrt-v4",
        (Sampler, "maxmindist") => "it is `pmj02bn` in pbrt-v4",
        (Sampler, "bestcandidate" | "adaptive") => "this is pbrt-v2; pbrt-v4 has `zsobol`",
        (Integrator, "directlighting" | "whitted") => "in pbrt-v4: `Integrator \"path\" \"integer maxdepth\" 1`",
        (Camera, "environment") => "in pbrt-v4: `Camera \"spherical\" \"string mapping\" \"equirectangular\"`",
        (Shape, "cone" | "paraboloid" | "hyperboloid" | "heightfield" | "heightfield2" | "nurbs") => {
            "this shape of pbrt-v3 is no longer part of pbrt-v4; give it as a mesh"
        }
        (AreaLight, "area") => "pbrt-v3's `area` is `diffuse` in pbrt-v4",
        (Light, "exinfinite") => "it is `infinite` in pbrt-v4",
        (Medium, "heterogeneous") => "pbrt-v3's `heterogeneous` is `uniformgrid` in pbrt-v4",
        (FloatTexture | SpectrumTexture, "uv") => "this texture of pbrt-v3 is no longer part of pbrt-v4",
        _ => return None,
    })
}

/// A parameter of pbrt-v3.
pub(crate) fn parameter(category: Category, kind: &str, name: &str) -> Option<&'static str> {
    use Category::*;
    Some(match (category, kind, name) {
        (Material, _, "Kd") => "pbrt-v3's `Kd` is `reflectance` in pbrt-v4",
        (Material, _, "Ks" | "Kr" | "Kt" | "opacity") => "this parameter of pbrt-v3 has no counterpart in pbrt-v4",
        (Material, _, "bumpmap") => "pbrt-v3's `bumpmap` is `displacement` in pbrt-v4",
        (Material, _, "index") => "pbrt-v3's `index` is `eta` in pbrt-v4",
        (Material, "mix", "namedmaterial1" | "namedmaterial2") => {
            "in pbrt-v4: \"string materials\" [ \"second\" \"first\" ]"
        }
        (Material, "diffuse", "sigma") => "pbrt-v4's `diffuse` is Lambertian; it has no `sigma`",
        (Shape, _, "st") => "pbrt-v3's `st` is `uv` in pbrt-v4",
        (Shape, _, "shadowalpha") => "pbrt-v4 has only `alpha`, for all rays",
        (Shape, "loopsubdiv", "nlevels") => "pbrt-v3's `nlevels` is `levels` in pbrt-v4",
        (Light | AreaLight, _, "nsamples" | "samples") => "pbrt-v4 has no number of samples per light",
        (Light | AreaLight, _, "mapname") => "pbrt-v3's `mapname` is `filename` in pbrt-v4",
        (Film, _, "maxsampleluminance") => "pbrt-v3's `maxsampleluminance` is `maxcomponentvalue` in pbrt-v4",
        (Film, _, "scale") => "pbrt-v3's film `scale` is `iso` / 100 in pbrt-v4",
        (PixelFilter, _, "xwidth") => "pbrt-v3's `xwidth` is `xradius` in pbrt-v4",
        (PixelFilter, _, "ywidth") => "pbrt-v3's `ywidth` is `yradius` in pbrt-v4",
        (PixelFilter, "gaussian", "alpha") => "pbrt-v4 has `sigma` = 1/√(2·alpha)",
        (Integrator, _, "rrthreshold") => "pbrt-v4 has no `rrthreshold`",
        (Integrator, _, "lightsamplestrategy") => "pbrt-v3's `lightsamplestrategy` is `lightsampler` in pbrt-v4",
        (Integrator, _, "strategy") => "pbrt-v4 has no `strategy`",
        (Camera, "perspective", "halffov") => "pbrt-v4 has only `fov`",
        (Camera, "realistic", "simpleweighting") => "pbrt-v4 has no `simpleweighting`",
        (FloatTexture | SpectrumTexture, "imagemap", "trilinear") => "in pbrt-v4: \"string filter\" \"trilinear\"",
        (FloatTexture | SpectrumTexture, "imagemap" | "ptex", "gamma") => {
            "in pbrt-v4: \"string encoding\" \"sRGB\", \"linear\" or \"gamma 2.2\""
        }
        (FloatTexture | SpectrumTexture, "scale", "tex1" | "tex2") => "pbrt-v4 has `tex` and `scale`",
        _ => return None,
    })
}
