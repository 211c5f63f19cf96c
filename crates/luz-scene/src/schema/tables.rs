//! The tables: one line per kind of entity, one line per parameter.

use super::{Accepts, Category, Count, EntitySchema, ParameterSchema};
use crate::parameter::ParameterType as T;

const FLOAT: Accepts = Accepts::Type(T::Float);
const INTEGER: Accepts = Accepts::Type(T::Integer);
const BOOL: Accepts = Accepts::Type(T::Bool);
const STRING: Accepts = Accepts::Type(T::String);
const POINT2: Accepts = Accepts::Type(T::Point2);
const POINT3: Accepts = Accepts::Type(T::Point3);
const VECTOR3: Accepts = Accepts::Type(T::Vector3);
const NORMAL: Accepts = Accepts::Type(T::Normal);
const RGB: Accepts = Accepts::Type(T::Rgb);
const FILE: Accepts = Accepts::File;
const SPECTRUM: Accepts = Accepts::Spectrum;
const FLOAT_TEXTURE: Accepts = Accepts::FloatOrTexture;
const SPECTRUM_TEXTURE: Accepts = Accepts::SpectrumOrTexture;

const fn one(name: &'static str, accepts: Accepts) -> ParameterSchema {
    exactly(1, name, accepts)
}

const fn exactly(count: usize, name: &'static str, accepts: Accepts) -> ParameterSchema {
    ParameterSchema { name, accepts, count: Count::Exactly(count), required: false }
}

const fn many(name: &'static str, accepts: Accepts) -> ParameterSchema {
    ParameterSchema { name, accepts, count: Count::Many, required: false }
}

const fn required(schema: ParameterSchema) -> ParameterSchema {
    ParameterSchema { required: true, ..schema }
}

const fn kind(kind: &'static str, groups: &'static [&'static [ParameterSchema]]) -> EntitySchema {
    EntitySchema { kind, groups }
}

pub(super) fn kinds(category: Category) -> &'static [EntitySchema] {
    match category {
        Category::Shape => SHAPES,
        Category::Light => LIGHTS,
        Category::AreaLight => AREA_LIGHTS,
        Category::Material => MATERIALS,
        Category::FloatTexture => FLOAT_TEXTURES,
        Category::SpectrumTexture => SPECTRUM_TEXTURES,
        Category::Medium => MEDIA,
        Category::Camera => CAMERAS,
        Category::Film => FILMS,
        Category::PixelFilter => PIXEL_FILTERS,
        Category::Sampler => SAMPLERS,
        Category::Integrator => INTEGRATORS,
        Category::Accelerator => ACCELERATORS,
    }
}

const ANY_SHAPE: &[ParameterSchema] = &[one("alpha", FLOAT_TEXTURE)];

const QUADRIC: &[ParameterSchema] = &[one("radius", FLOAT), one("phimax", FLOAT)];

const SHAPES: &[EntitySchema] = &[
    kind("sphere", &[ANY_SHAPE, QUADRIC, &[one("zmin", FLOAT), one("zmax", FLOAT)]]),
    kind("cylinder", &[ANY_SHAPE, QUADRIC, &[one("zmin", FLOAT), one("zmax", FLOAT)]]),
    kind("disk", &[ANY_SHAPE, QUADRIC, &[one("height", FLOAT), one("innerradius", FLOAT)]]),
    kind(
        "trianglemesh",
        &[
            ANY_SHAPE,
            &[
                required(many("P", POINT3)),
                many("indices", INTEGER),
                many("uv", POINT2),
                many("N", NORMAL),
                many("S", VECTOR3),
                many("faceIndices", INTEGER),
            ],
        ],
    ),
    kind(
        "bilinearmesh",
        &[
            ANY_SHAPE,
            &[
                required(many("P", POINT3)),
                many("indices", INTEGER),
                many("uv", POINT2),
                many("N", NORMAL),
                many("faceIndices", INTEGER),
                one("emissionfilename", FILE),
            ],
        ],
    ),
    kind(
        "plymesh",
        &[
            ANY_SHAPE,
            &[
                required(one("filename", FILE)),
                one("displacement", Accepts::FloatTexture),
                one("edgelength", FLOAT),
                one("displacement.edgelength", FLOAT),
            ],
        ],
    ),
    kind(
        "loopsubdiv",
        &[
            ANY_SHAPE,
            &[
                required(many("P", POINT3)),
                required(many("indices", INTEGER)),
                one("levels", INTEGER),
                one("scheme", STRING),
            ],
        ],
    ),
    kind(
        "curve",
        &[
            ANY_SHAPE,
            &[
                required(many("P", POINT3)),
                one("width", FLOAT),
                one("width0", FLOAT),
                one("width1", FLOAT),
                one("degree", INTEGER),
                one("basis", STRING),
                one("type", STRING),
                many("N", NORMAL),
                one("splitdepth", INTEGER),
            ],
        ],
    ),
];

const ANY_LIGHT: &[ParameterSchema] = &[one("scale", FLOAT)];

const LIGHTS: &[EntitySchema] = &[
    kind("point", &[ANY_LIGHT, &[one("I", SPECTRUM), one("power", FLOAT), one("from", POINT3)]]),
    kind(
        "spot",
        &[
            ANY_LIGHT,
            &[
                one("I", SPECTRUM),
                one("power", FLOAT),
                one("from", POINT3),
                one("to", POINT3),
                one("coneangle", FLOAT),
                one("conedeltaangle", FLOAT),
            ],
        ],
    ),
    kind(
        "distant",
        &[ANY_LIGHT, &[one("L", SPECTRUM), one("illuminance", FLOAT), one("from", POINT3), one("to", POINT3)]],
    ),
    kind(
        "infinite",
        &[
            ANY_LIGHT,
            &[
                one("L", SPECTRUM),
                one("filename", FILE),
                // `point` or `bilinear`; not in pbrt-v4.
                one("filter", STRING),
                one("illuminance", FLOAT),
                exactly(4, "portal", POINT3),
            ],
        ],
    ),
    kind("projection", &[ANY_LIGHT, &[one("power", FLOAT), one("fov", FLOAT), required(one("filename", FILE))]]),
    kind("goniometric", &[ANY_LIGHT, &[one("I", SPECTRUM), one("power", FLOAT), one("filename", FILE)]]),
];

const AREA_LIGHTS: &[EntitySchema] = &[kind(
    "diffuse",
    &[ANY_LIGHT, &[one("L", SPECTRUM), one("power", FLOAT), one("twosided", BOOL), one("filename", FILE)]],
)];

/// `type` is `MakeNamedMaterial`'s.
const ANY_MATERIAL: &[ParameterSchema] = &[one("type", STRING)];

const BUMP: &[ParameterSchema] = &[one("displacement", FLOAT_TEXTURE), one("normalmap", FILE)];

const ROUGHNESS: &[ParameterSchema] = &[
    one("roughness", FLOAT_TEXTURE),
    one("uroughness", FLOAT_TEXTURE),
    one("vroughness", FLOAT_TEXTURE),
    one("remaproughness", BOOL),
];

const LAYERS: &[ParameterSchema] = &[
    one("thickness", FLOAT_TEXTURE),
    one("g", FLOAT_TEXTURE),
    one("albedo", SPECTRUM_TEXTURE),
    one("maxdepth", INTEGER),
    one("nsamples", INTEGER),
];

const MATERIALS: &[EntitySchema] = &[
    kind("interface", &[ANY_MATERIAL]),
    kind("diffuse", &[ANY_MATERIAL, BUMP, &[one("reflectance", SPECTRUM_TEXTURE)]]),
    kind(
        "coateddiffuse",
        &[
            ANY_MATERIAL,
            BUMP,
            ROUGHNESS,
            LAYERS,
            &[one("reflectance", SPECTRUM_TEXTURE), one("eta", Accepts::FloatOrSpectrum)],
        ],
    ),
    kind(
        "coatedconductor",
        &[
            ANY_MATERIAL,
            BUMP,
            LAYERS,
            &[
                one("interface.roughness", FLOAT_TEXTURE),
                one("interface.uroughness", FLOAT_TEXTURE),
                one("interface.vroughness", FLOAT_TEXTURE),
                one("interface.eta", Accepts::FloatOrSpectrum),
                one("conductor.roughness", FLOAT_TEXTURE),
                one("conductor.uroughness", FLOAT_TEXTURE),
                one("conductor.vroughness", FLOAT_TEXTURE),
                one("conductor.eta", SPECTRUM_TEXTURE),
                one("conductor.k", SPECTRUM_TEXTURE),
                one("reflectance", SPECTRUM_TEXTURE),
                one("remaproughness", BOOL),
            ],
        ],
    ),
    kind(
        "diffusetransmission",
        &[
            ANY_MATERIAL,
            BUMP,
            &[
                one("reflectance", SPECTRUM_TEXTURE),
                one("transmittance", SPECTRUM_TEXTURE),
                one("scale", FLOAT),
                one("remaproughness", BOOL),
            ],
        ],
    ),
    kind("dielectric", &[ANY_MATERIAL, BUMP, ROUGHNESS, &[one("eta", Accepts::FloatOrSpectrum)]]),
    kind("thindielectric", &[ANY_MATERIAL, BUMP, &[one("eta", Accepts::FloatOrSpectrum)]]),
    kind(
        "conductor",
        &[
            ANY_MATERIAL,
            BUMP,
            ROUGHNESS,
            &[one("eta", SPECTRUM_TEXTURE), one("k", SPECTRUM_TEXTURE), one("reflectance", SPECTRUM_TEXTURE)],
        ],
    ),
    kind(
        "hair",
        &[
            ANY_MATERIAL,
            &[
                one("sigma_a", SPECTRUM_TEXTURE),
                one("reflectance", SPECTRUM_TEXTURE),
                one("color", SPECTRUM_TEXTURE),
                one("eumelanin", FLOAT_TEXTURE),
                one("pheomelanin", FLOAT_TEXTURE),
                one("eta", FLOAT_TEXTURE),
                one("beta_m", FLOAT_TEXTURE),
                one("beta_n", FLOAT_TEXTURE),
                one("alpha", FLOAT_TEXTURE),
            ],
        ],
    ),
    kind("measured", &[ANY_MATERIAL, BUMP, &[required(one("filename", FILE))]]),
    kind(
        "subsurface",
        &[
            ANY_MATERIAL,
            BUMP,
            ROUGHNESS,
            &[
                one("name", STRING),
                one("sigma_a", SPECTRUM_TEXTURE),
                one("sigma_s", SPECTRUM_TEXTURE),
                one("reflectance", SPECTRUM_TEXTURE),
                one("mfp", SPECTRUM_TEXTURE),
                one("scale", FLOAT),
                one("eta", FLOAT),
                one("g", FLOAT),
            ],
        ],
    ),
    kind("mix", &[ANY_MATERIAL, &[required(exactly(2, "materials", STRING)), one("amount", FLOAT_TEXTURE)]]),
];

const MAPPING_2D: &[ParameterSchema] = &[
    one("mapping", STRING),
    one("uscale", FLOAT),
    one("vscale", FLOAT),
    one("udelta", FLOAT),
    one("vdelta", FLOAT),
    one("v1", VECTOR3),
    one("v2", VECTOR3),
];

const IMAGE: &[ParameterSchema] = &[
    required(one("filename", FILE)),
    one("filter", STRING),
    one("wrap", STRING),
    one("maxanisotropy", FLOAT),
    one("scale", FLOAT),
    one("invert", BOOL),
    one("encoding", STRING),
];

const PTEX: &[ParameterSchema] = &[required(one("filename", FILE)), one("encoding", STRING), one("scale", FLOAT)];

const NOISE: &[ParameterSchema] = &[one("octaves", INTEGER), one("roughness", FLOAT)];

const FLOAT_TEXTURES: &[EntitySchema] = &[
    kind("constant", &[&[one("value", FLOAT)]]),
    kind("scale", &[&[one("tex", FLOAT_TEXTURE), one("scale", FLOAT_TEXTURE)]]),
    kind("mix", &[&[one("tex1", FLOAT_TEXTURE), one("tex2", FLOAT_TEXTURE), one("amount", FLOAT_TEXTURE)]]),
    kind("directionmix", &[&[one("tex1", FLOAT_TEXTURE), one("tex2", FLOAT_TEXTURE), one("dir", VECTOR3)]]),
    kind("bilerp", &[MAPPING_2D, &[one("v00", FLOAT), one("v01", FLOAT), one("v10", FLOAT), one("v11", FLOAT)]]),
    kind("imagemap", &[MAPPING_2D, IMAGE]),
    kind(
        "checkerboard",
        &[MAPPING_2D, &[one("dimension", INTEGER), one("tex1", FLOAT_TEXTURE), one("tex2", FLOAT_TEXTURE)]],
    ),
    kind("dots", &[MAPPING_2D, &[one("inside", FLOAT_TEXTURE), one("outside", FLOAT_TEXTURE)]]),
    kind("fbm", &[NOISE]),
    kind("wrinkled", &[NOISE]),
    kind("windy", &[]),
    kind("ptex", &[PTEX]),
];

const SPECTRUM_TEXTURES: &[EntitySchema] = &[
    kind("constant", &[&[one("value", SPECTRUM)]]),
    kind("scale", &[&[one("tex", SPECTRUM_TEXTURE), one("scale", FLOAT_TEXTURE)]]),
    kind("mix", &[&[one("tex1", SPECTRUM_TEXTURE), one("tex2", SPECTRUM_TEXTURE), one("amount", FLOAT_TEXTURE)]]),
    kind("directionmix", &[&[one("tex1", SPECTRUM_TEXTURE), one("tex2", SPECTRUM_TEXTURE), one("dir", VECTOR3)]]),
    kind(
        "bilerp",
        &[MAPPING_2D, &[one("v00", SPECTRUM), one("v01", SPECTRUM), one("v10", SPECTRUM), one("v11", SPECTRUM)]],
    ),
    kind("imagemap", &[MAPPING_2D, IMAGE]),
    kind(
        "checkerboard",
        &[MAPPING_2D, &[one("dimension", INTEGER), one("tex1", SPECTRUM_TEXTURE), one("tex2", SPECTRUM_TEXTURE)]],
    ),
    kind("dots", &[MAPPING_2D, &[one("inside", SPECTRUM_TEXTURE), one("outside", SPECTRUM_TEXTURE)]]),
    kind("marble", &[NOISE, &[one("scale", FLOAT), one("variation", FLOAT)]]),
    kind("ptex", &[PTEX]),
];

/// `type` is `MakeNamedMedium`'s.
const ANY_MEDIUM: &[ParameterSchema] = &[one("type", STRING), one("g", FLOAT), one("scale", FLOAT)];

const SCATTERING: &[ParameterSchema] = &[one("sigma_a", SPECTRUM), one("sigma_s", SPECTRUM), one("preset", STRING)];

const EMISSION: &[ParameterSchema] = &[one("Le", SPECTRUM)];

const BOX: &[ParameterSchema] = &[one("p0", POINT3), one("p1", POINT3)];

const GRID: &[ParameterSchema] = &[one("nx", INTEGER), one("ny", INTEGER), one("nz", INTEGER)];

const TEMPERATURE: &[ParameterSchema] =
    &[one("temperatureoffset", FLOAT), one("temperaturecutoff", FLOAT), one("temperaturescale", FLOAT)];

const MEDIA: &[EntitySchema] = &[
    kind("homogeneous", &[ANY_MEDIUM, SCATTERING, EMISSION, &[one("Lescale", FLOAT)]]),
    kind(
        "uniformgrid",
        &[
            ANY_MEDIUM,
            SCATTERING,
            EMISSION,
            BOX,
            GRID,
            TEMPERATURE,
            &[many("density", Accepts::FloatOrRgb), many("temperature", FLOAT), many("Lescale", FLOAT)],
        ],
    ),
    kind(
        "rgbgrid",
        &[ANY_MEDIUM, BOX, GRID, &[many("sigma_a", RGB), many("sigma_s", RGB), many("Le", RGB), one("Lescale", FLOAT)]],
    ),
    kind(
        "cloud",
        &[ANY_MEDIUM, SCATTERING, BOX, &[one("density", FLOAT), one("wispiness", FLOAT), one("frequency", FLOAT)]],
    ),
    kind(
        "nanovdb",
        &[
            ANY_MEDIUM,
            SCATTERING,
            EMISSION,
            TEMPERATURE,
            &[required(one("filename", FILE)), one("Lescale", FLOAT), one("LeScale", FLOAT)],
        ],
    ),
];

const SHUTTER: &[ParameterSchema] = &[one("shutteropen", FLOAT), one("shutterclose", FLOAT)];

const PROJECTIVE: &[ParameterSchema] = &[
    one("lensradius", FLOAT),
    one("focaldistance", FLOAT),
    one("frameaspectratio", FLOAT),
    exactly(4, "screenwindow", FLOAT),
];

const CAMERAS: &[EntitySchema] = &[
    kind("perspective", &[SHUTTER, PROJECTIVE, &[one("fov", FLOAT)]]),
    kind("orthographic", &[SHUTTER, PROJECTIVE]),
    kind("spherical", &[SHUTTER, PROJECTIVE, &[one("mapping", STRING)]]),
    kind(
        "realistic",
        &[
            SHUTTER,
            &[
                required(one("lensfile", FILE)),
                one("aperturediameter", FLOAT),
                one("focusdistance", FLOAT),
                one("aperture", STRING),
            ],
        ],
    ),
];

const ANY_FILM: &[ParameterSchema] = &[
    one("filename", STRING),
    one("xresolution", INTEGER),
    one("yresolution", INTEGER),
    exactly(4, "pixelbounds", INTEGER),
    exactly(4, "cropwindow", FLOAT),
    one("diagonal", FLOAT),
    one("iso", FLOAT),
    one("whitebalance", FLOAT),
    one("sensor", STRING),
    one("maxcomponentvalue", FLOAT),
    one("savefp16", BOOL),
];

const FILMS: &[EntitySchema] = &[
    kind("rgb", &[ANY_FILM]),
    kind("gbuffer", &[ANY_FILM, &[one("coordinatesystem", STRING)]]),
    kind("spectral", &[ANY_FILM, &[one("nbuckets", INTEGER), one("lambdamin", FLOAT), one("lambdamax", FLOAT)]]),
];

const RADIUS: &[ParameterSchema] = &[one("xradius", FLOAT), one("yradius", FLOAT)];

const PIXEL_FILTERS: &[EntitySchema] = &[
    kind("box", &[RADIUS]),
    kind("triangle", &[RADIUS]),
    kind("gaussian", &[RADIUS, &[one("sigma", FLOAT)]]),
    kind("mitchell", &[RADIUS, &[one("B", FLOAT), one("C", FLOAT)]]),
    kind("sinc", &[RADIUS, &[one("tau", FLOAT)]]),
];

const PIXEL_SAMPLES: &[ParameterSchema] = &[one("pixelsamples", INTEGER), one("seed", INTEGER)];

const RANDOMIZATION: &[ParameterSchema] = &[one("randomization", STRING)];

const SAMPLERS: &[EntitySchema] = &[
    kind("independent", &[PIXEL_SAMPLES]),
    kind(
        "stratified",
        &[&[one("xsamples", INTEGER), one("ysamples", INTEGER), one("jitter", BOOL), one("seed", INTEGER)]],
    ),
    kind("halton", &[PIXEL_SAMPLES, RANDOMIZATION]),
    kind("sobol", &[PIXEL_SAMPLES, RANDOMIZATION]),
    kind("paddedsobol", &[PIXEL_SAMPLES, RANDOMIZATION]),
    kind("zsobol", &[PIXEL_SAMPLES, RANDOMIZATION]),
    kind("pmj02bn", &[PIXEL_SAMPLES]),
];

const MAX_DEPTH: &[ParameterSchema] = &[one("maxdepth", INTEGER)];

const REGULARIZE: &[ParameterSchema] = &[one("regularize", BOOL)];

const LIGHT_SAMPLER: &[ParameterSchema] = &[one("lightsampler", STRING)];

const INTEGRATORS: &[EntitySchema] = &[
    kind("path", &[MAX_DEPTH, REGULARIZE, LIGHT_SAMPLER]),
    kind("volpath", &[MAX_DEPTH, REGULARIZE, LIGHT_SAMPLER]),
    kind("simplepath", &[MAX_DEPTH, &[one("samplelights", BOOL), one("samplebsdf", BOOL)]]),
    kind("simplevolpath", &[MAX_DEPTH]),
    kind("lightpath", &[MAX_DEPTH]),
    kind("randomwalk", &[MAX_DEPTH]),
    kind(
        "bdpt",
        &[MAX_DEPTH, REGULARIZE, LIGHT_SAMPLER, &[one("visualizestrategies", BOOL), one("visualizeweights", BOOL)]],
    ),
    kind(
        "mlt",
        &[
            MAX_DEPTH,
            REGULARIZE,
            &[
                one("bootstrapsamples", INTEGER),
                one("chains", INTEGER),
                one("mutationsperpixel", INTEGER),
                one("largestepprobability", FLOAT),
                one("sigma", FLOAT),
            ],
        ],
    ),
    kind(
        "sppm",
        &[MAX_DEPTH, REGULARIZE, &[one("photonsperiteration", INTEGER), one("radius", FLOAT), one("seed", INTEGER)]],
    ),
    kind("ambientocclusion", &[&[one("cossample", BOOL), one("maxdistance", FLOAT)]]),
    kind("function", &[&[one("function", STRING), one("filename", STRING), one("skipbad", BOOL)]]),
];

const ACCELERATORS: &[EntitySchema] = &[
    kind("bvh", &[&[one("maxnodeprims", INTEGER), one("splitmethod", STRING)]]),
    kind(
        "kdtree",
        &[&[
            one("intersectcost", INTEGER),
            one("traversalcost", INTEGER),
            one("emptybonus", FLOAT),
            one("maxprims", INTEGER),
            one("maxdepth", INTEGER),
        ]],
    ),
];
