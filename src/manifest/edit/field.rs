//! The fields that paths can reach, each with what it takes.

use crate::disney::Parameter;

/// One of the enumerations below.
pub(super) trait Field: Sized {
    /// The names in paths.
    const NAMES: &'static [&'static str];

    /// The field of that name.
    fn of_name(name: &str) -> Option<Self>;
}

/// An enumeration of fields with their names in paths and what each takes.
macro_rules! fields {
    ($(#[$doc:meta])* $type:ident { $($variant:ident $name:literal: $expects:literal,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum $type {
            $(#[doc = concat!("`", $name, "`: ", $expects, ".")] $variant,)*
        }

        impl $type {
            /// All of them.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// The name in paths.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// What it takes, with range and unit.
            pub const fn expects(self) -> &'static str {
                match self { $(Self::$variant => $expects,)* }
            }

            /// The field of that name.
            pub fn from_name(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|f| f.name() == name)
            }
        }

        impl Field for $type {
            const NAMES: &'static [&'static str] = &[$($name,)*];

            fn of_name(name: &str) -> Option<Self> {
                Self::from_name(name)
            }
        }
    };
}

fields! {
    /// A field of a material.
    MaterialField {
        BaseColor "base_color": "a colour [r, g, b] in [0, 1] or \"#rrggbb\"",
        Subsurface "subsurface": "a number in [0, 1]",
        Metallic "metallic": "a number in [0, 1]",
        Specular "specular": "a number in [0, 12.5]",
        SpecularTint "specular_tint": "a number in [0, 1]",
        Roughness "roughness": "a number in [0, 1]",
        Anisotropic "anisotropic": "a number in [0, 1]",
        Sheen "sheen": "a number in [0, 1]",
        SheenTint "sheen_tint": "a number in [0, 1]",
        Clearcoat "clearcoat": "a number in [0, 4]",
        ClearcoatGloss "clearcoat_gloss": "a number in [0, 1]",
        Model "model": "one of \"disney\", \"diffuse\", \"mirror\", \"dielectric\"",
        Masking "masking": "one of \"matched\", \"remapped\"",
        Diffuse "diffuse": "one of \"burley\", \"lambert\", \"lambert_fresnel\"",
        SpecTrans "spec_trans": "a number in [0, 1]",
        Ior "ior": "a number in [0.1, 10]",
        DiffTrans "diff_trans": "a number in [0, 2]",
        F90 "f90": "a number in [0, 1]",
        TransmissionColor "transmission_color": "a colour [r, g, b] in [0, 1] or \"#rrggbb\", or false for none",
        DiffTransColor "diff_trans_color": "a colour [r, g, b] in [0, 1] or \"#rrggbb\", or false for none",
        ThinWalled "thin_walled": "true or false",
        Absorption "absorption": "coefficients [r, g, b] per metre, not negative",
        EmissionColor "emission_color": "a colour [r, g, b], not negative, or \"#rrggbb\"",
        EmissionStrength "emission_strength": "a number, not negative",
        Opacity "opacity": "a number in [0, 1]",
        Cutoff "cutoff": "a number in [0, 1], or false for none",
        NormalScale "normal_scale": "a number",
        Rotation "rotation": "a number of degrees",
    }
}

impl MaterialField {
    /// The scalar parameter that it is, if it is one.
    pub fn parameter(self) -> Option<Parameter> {
        Parameter::from_name(self.name())
    }
}

fields! {
    /// A field of the camera that renders.
    CameraField {
        Name "name": "the name of one of the scene's cameras",
        Position "position": "a position [x, y, z] in metres",
        Target "target": "a position [x, y, z] in metres",
        Up "up": "a direction [x, y, z]",
        Orbit "orbit": "angles [azimuth, elevation] in degrees, the elevation in [-90, 90]",
        Distance "distance": "a number of metres above 0",
        Roll "roll": "a number of degrees",
        CameraToWorld "c2w": "three rows of four numbers, an invertible matrix",
        Fov "fov": "a number of degrees in [0.1, 179]",
        FovX "fov_x": "a number of degrees in [0.1, 179]",
        LensRadius "lens_radius": "a number of metres, not negative",
        FocalDistance "focal_distance": "a number of metres above 0",
        PixelOffset "pixel_offset": "an offset [x, y] in pixels",
    }
}

fields! {
    /// A field of a light.
    LightField {
        Color "color": "a colour [r, g, b], not negative, or \"#rrggbb\"",
        Intensity "intensity": "a number, not negative",
        Position "position": "a position [x, y, z] in metres",
        Direction "direction": "a direction [x, y, z]",
        Inner "inner": "a number of degrees in [0, 90]",
        Outer "outer": "a number of degrees in [0, 90]",
        Range "range": "a number of metres above 0, or false for none",
    }
}

fields! {
    /// A field of the environment.
    EnvironmentField {
        Kind "kind": "one of \"constant\", \"none\"",
        Image "image": "the file of an equirectangular image",
        Color "color": "a colour [r, g, b], not negative, or \"#rrggbb\"",
        Intensity "intensity": "a number, not negative",
        Rotation "rotation": "a number of degrees",
    }
}

fields! {
    /// A setting of the render.
    RenderField {
        Width "width": "a whole number in [1, 65536]",
        Height "height": "a whole number in [1, 65536]",
        Spp "spp": "a whole number in [1, 16777216]",
        Error "error": "a number in (0, 1], or false for none",
        Replicates "replicates": "a whole number in [1, 64]",
        Seed "seed": "a whole number in [0, 9007199254740992]",
        MaxDepth "max_depth": "a whole number in [0, 65535]",
        Filter "filter": "one of \"box\", \"tent\", \"blackman-harris\", \"point\"",
        FilterRadius "filter_radius": "a number of pixels in [0.1, 8]",
        Camera "camera": "the name of one of the scene's cameras",
        Integrator "integrator": "one of \"path\", \"normals\", \"albedo\", \"diffuse_albedo\", \"depths\", \"ao\", \"whitted\", \"emitter_check\"",
        Nee "nee": "true or false",
        Mis "mis": "true or false",
        LightPaths "light_paths": "one of \"auto\", \"always\", \"never\"",
        PathReuse "path_reuse": "one of \"auto\", \"always\", \"never\"",
        Splitting "splitting": "one of \"auto\", \"always\", \"never\"",
        Adaptive "adaptive": "one of \"auto\", \"always\", \"never\"",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scalar_is_a_field_and_says_its_range() {
        for p in Parameter::ALL {
            let field = MaterialField::from_name(p.name()).unwrap();
            assert_eq!(field.expects(), format!("a number in [{}, {}]", p.min(), p.max()));
            assert_eq!(field.parameter(), Some(p));
        }
        assert_eq!(MaterialField::Model.parameter(), None);
    }
}

fields! {
    /// A choice of the import.
    ImportField {
        Variant "variant": "the name of one of the file's material variants, or false for the materials' own",
        Time "time": "a number of seconds, or false for the pose at rest",
        Animation "animation": "the name of one of the file's animations, or false for the first",
        LightUnits "light_units": "one of \"photometric\", \"blender\"",
    }
}

fields! {
    /// A choice of the conversion.
    ConvertField {
        Diffuse "diffuse": "one of \"burley\", \"lambert\", \"lambert_fresnel\", or false for the dialect's own",
        Clearcoat "clearcoat": "one of \"matched\", \"published\"",
        SheenScale "sheen_scale": "a number, not negative",
        Phong "phong": "one of \"walter\", \"blender\"",
        Cull "cull": "true or false",
    }
}
