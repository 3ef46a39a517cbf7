//! Flattens a WGSL type into its 32-bit scalars, in declaration order.

use naga::{Handle, Module, ScalarKind, Type, TypeInner, VectorSize};

/// What a leaf holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Scalar {
    /// IEEE binary32.
    F32,
    /// Unsigned.
    U32,
    /// Two's complement.
    I32,
}

impl Scalar {
    /// The WGSL type.
    pub fn wgsl(self) -> &'static str {
        match self {
            Scalar::F32 => "f32",
            Scalar::U32 => "u32",
            Scalar::I32 => "i32",
        }
    }
}

/// One 32-bit scalar of a struct.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Leaf {
    /// How WGSL reaches it from the whole, with a leading dot for members: `.origin.x`, `.stack[2]`; empty for a plain scalar.
    pub path: String,
    /// What it holds.
    pub scalar: Scalar,
}

fn scalar(kind: naga::Scalar) -> Result<Scalar, String> {
    match (kind.kind, kind.width) {
        (ScalarKind::Float, 4) => Ok(Scalar::F32),
        (ScalarKind::Uint, 4) => Ok(Scalar::U32),
        (ScalarKind::Sint, 4) => Ok(Scalar::I32),
        (ScalarKind::Bool, _) => Err("bool has no bit pattern of its own: use u32".into()),
        (kind, width) => Err(format!("{kind:?} of {width} bytes is not a 32-bit scalar")),
    }
}

const COMPONENTS: [&str; 4] = [".x", ".y", ".z", ".w"];

fn vector(prefix: &str, size: VectorSize, kind: naga::Scalar, out: &mut Vec<Leaf>) -> Result<(), String> {
    let scalar = scalar(kind)?;
    out.extend(COMPONENTS[..size as usize].iter().map(|part| Leaf { path: format!("{prefix}{part}"), scalar }));
    Ok(())
}

/// Leaves that a state or a result may have: 16 KiB per lane are beyond every use.
pub(crate) const MOST_LEAVES: usize = 4096;

/// The leaves of `ty` in declaration order, or why it cannot be state.
pub(crate) fn flatten(module: &Module, ty: Handle<Type>, prefix: &str, out: &mut Vec<Leaf>) -> Result<(), String> {
    match &module.types[ty].inner {
        TypeInner::Scalar(kind) => {
            out.push(Leaf { path: prefix.to_owned(), scalar: scalar(*kind)? });
            Ok(())
        }
        TypeInner::Vector { size, scalar } => vector(prefix, *size, *scalar, out),
        TypeInner::Matrix { columns, rows, scalar } => {
            (0..*columns as u32).try_for_each(|column| vector(&format!("{prefix}[{column}]"), *rows, *scalar, out))
        }
        TypeInner::Array { base, size: naga::ArraySize::Constant(count), .. } => {
            (0..count.get()).try_for_each(|index| flatten(module, *base, &format!("{prefix}[{index}]"), out))
        }
        TypeInner::Struct { members, .. } => members.iter().try_for_each(|member| {
            let name = member.name.as_deref().unwrap_or("");
            flatten(module, member.ty, &format!("{prefix}.{name}"), out)
        }),
        _ => Err("only f32, u32, i32, vectors, matrices, fixed arrays and structs of these".into()),
    }
}

/// How many leaves `ty` has; zero for what [`flatten`] refuses.
pub(crate) fn leaf_count(module: &Module, ty: Handle<Type>) -> usize {
    match &module.types[ty].inner {
        TypeInner::Scalar(_) => 1,
        TypeInner::Vector { size, .. } => *size as usize,
        TypeInner::Matrix { columns, rows, .. } => *columns as usize * *rows as usize,
        TypeInner::Array { base, size: naga::ArraySize::Constant(count), .. } => {
            (count.get() as usize).saturating_mul(leaf_count(module, *base))
        }
        TypeInner::Struct { members, .. } => members.iter().fold(0, |sum: usize, member| sum.saturating_add(leaf_count(module, member.ty))),
        _ => 0,
    }
}
