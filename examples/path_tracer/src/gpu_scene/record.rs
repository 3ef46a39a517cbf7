//! Records that the host writes and the kernels read, declared once.
//!
//! Key decision: a record is a flat run of 32-bit words. The macro makes the Rust struct; from the same field list come the WGSL struct
//! and a function that unpacks it from rows of four words, so that one untyped buffer can hold tables of many kinds.
//!
//! **Invariant:** a record is whole rows long and every field sits where WGSL's layout rules would put it; both are checked when the
//! crate is compiled.

use std::fmt::Write as _;

/// The WGSL type of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldType {
    /// `f32`
    F32,
    /// `u32`
    U32,
    /// `vec3f`
    Vec3f,
    /// `vec3u`
    Vec3u,
    /// `vec4f`
    Vec4f,
    /// `vec4u`
    Vec4u,
}

impl FieldType {
    const fn words(self) -> usize {
        match self {
            FieldType::F32 | FieldType::U32 => 1,
            FieldType::Vec3f | FieldType::Vec3u => 3,
            FieldType::Vec4f | FieldType::Vec4u => 4,
        }
    }

    const fn wgsl(self) -> &'static str {
        match self {
            FieldType::F32 => "f32",
            FieldType::U32 => "u32",
            FieldType::Vec3f => "vec3f",
            FieldType::Vec3u => "vec3u",
            FieldType::Vec4f => "vec4f",
            FieldType::Vec4u => "vec4u",
        }
    }

    const fn is_float(self) -> bool {
        matches!(self, FieldType::F32 | FieldType::Vec3f | FieldType::Vec4f)
    }
}

/// Stops the compilation of a record whose fields straddle rows or that ends inside of one.
pub(crate) const fn check_layout(fields: &[(&str, FieldType)]) {
    let mut word = 0;
    let mut index = 0;
    while index < fields.len() {
        let words = fields[index].1.words();
        assert!(words == 1 || word % 4 == 0, "a vector must begin a row");
        word += words;
        index += 1;
    }
    assert!(word % 4 == 0, "a record must fill its last row");
}

/// What [`records_wgsl`](super::records_wgsl) needs to know of a record.
pub trait GpuRecord: bytemuck::Pod {
    /// Its name in WGSL.
    const NAME: &'static str;
    /// Its fields in order.
    const FIELDS: &'static [(&'static str, FieldType)];
    /// Rows of four words.
    const ROWS: u32 = (size_of::<Self>() / 16) as u32;
}

/// The WGSL struct and its `unpack_` function.
pub(crate) fn declare<R: GpuRecord>(text: &mut String) {
    let name = R::NAME;
    let _ = writeln!(text, "struct {name} {{");
    for (field, kind) in R::FIELDS {
        let _ = writeln!(text, "    {field}: {},", kind.wgsl());
    }
    let _ = writeln!(text, "}}");
    let upper = snake(name).to_uppercase();
    let _ = writeln!(text, "const {upper}_ROWS: u32 = {}u;", R::ROWS);
    let parameters: Vec<String> = (0..R::ROWS).map(|row| format!("r{row}: vec4u")).collect();
    let mut word = 0;
    let arguments: Vec<String> = R::FIELDS
        .iter()
        .map(|(_, kind)| {
            let part = format!("r{}.{}", word / 4, &"xyzw"[word % 4..word % 4 + kind.words()]);
            word += kind.words();
            if kind.is_float() { format!("bitcast<{}>({part})", kind.wgsl()) } else { part }
        })
        .collect();
    let _ = writeln!(
        text,
        "fn unpack_{}({}) -> {name} {{\n    return {name}({});\n}}",
        snake(name),
        parameters.join(", "),
        arguments.join(", ")
    );
}

fn snake(name: &str) -> String {
    let mut text = String::new();
    for character in name.chars() {
        if character.is_uppercase() && !text.is_empty() {
            text.push('_');
        }
        text.push(character.to_ascii_lowercase());
    }
    text
}

macro_rules! field_type {
    (f32) => {
        f32
    };
    (u32) => {
        u32
    };
    (vec3f) => {
        [f32; 3]
    };
    (vec3u) => {
        [u32; 3]
    };
    (vec4f) => {
        [f32; 4]
    };
    (vec4u) => {
        [u32; 4]
    };
    (@tag f32) => {
        $crate::gpu_scene::record::FieldType::F32
    };
    (@tag u32) => {
        $crate::gpu_scene::record::FieldType::U32
    };
    (@tag vec3f) => {
        $crate::gpu_scene::record::FieldType::Vec3f
    };
    (@tag vec3u) => {
        $crate::gpu_scene::record::FieldType::Vec3u
    };
    (@tag vec4f) => {
        $crate::gpu_scene::record::FieldType::Vec4f
    };
    (@tag vec4u) => {
        $crate::gpu_scene::record::FieldType::Vec4u
    };
}

/// Declares a record: `gpu_record! { /// doc  pub struct MaterialRecord as "Material" { /// doc  base_color: vec4f, } }`.
macro_rules! gpu_record {
    ($(#[$outer:meta])* pub struct $name:ident as $wgsl:literal { $($(#[$inner:meta])* $field:ident: $kind:ident,)* }) => {
        $(#[$outer])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        pub struct $name { $($(#[$inner])* pub $field: $crate::gpu_scene::record::field_type!($kind),)* }

        impl $crate::gpu_scene::record::GpuRecord for $name {
            const NAME: &'static str = $wgsl;
            const FIELDS: &'static [(&'static str, $crate::gpu_scene::record::FieldType)] =
                &[$((stringify!($field), $crate::gpu_scene::record::field_type!(@tag $kind)),)*];
        }

        const _: () = $crate::gpu_scene::record::check_layout(<$name as $crate::gpu_scene::record::GpuRecord>::FIELDS);
    };
}

pub(crate) use {field_type, gpu_record};

#[cfg(test)]
#[allow(unreachable_pub, reason = "the macro declares records for other modules")]
mod tests {
    use super::*;

    gpu_record! {
        /// A record for this test.
        pub struct SampleRecord as "SampleThing" {
            /// First row.
            a: vec3f,
            /// First row's end.
            b: u32,
            /// Second row.
            c: vec4u,
        }
    }

    // Kills: a component letter off by one, a float read without its bitcast, a row too few.
    #[test]
    fn a_record_unpacks_from_its_rows() {
        let mut text = String::new();
        declare::<SampleRecord>(&mut text);
        assert!(text.contains("struct SampleThing {\n    a: vec3f,\n    b: u32,\n    c: vec4u,\n}"), "{text}");
        assert!(text.contains("fn unpack_sample_thing(r0: vec4u, r1: vec4u) -> SampleThing"), "{text}");
        assert!(text.contains("SampleThing(bitcast<vec3f>(r0.xyz), r0.w, r1.xyzw)"), "{text}");
        assert!(text.contains("const SAMPLE_THING_ROWS: u32 = 2u;"), "{text}");
    }

    // Kills: a layout check that lets a vector straddle two rows.
    #[test]
    #[should_panic(expected = "begin a row")]
    fn a_straddling_vector_is_refused() {
        check_layout(&[("a", FieldType::F32), ("b", FieldType::Vec3f)]);
    }
}
