//! Lays the tables out one after the other and tells the view where each begins.
//!
//! **Invariant:** every table begins on a row of 16 bytes.

use super::{
    alias::AliasTable,
    coat,
    environment::PackedEnvironment,
    lights::Lights,
    records::{MaterialRecord, ViewRecord, material_flags},
    textures::{Textures, srgb_to_linear},
};

/// Rows of the table buffer and words of the texel buffer.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tables {
    pub(crate) rows: Vec<[u32; 4]>,
    pub(crate) texels: Vec<u32>,
}

/// The largest panorama whose tables fit next to a mebibyte of others: 12 bytes per entry, entries padded to a power of two.
pub(crate) fn environment_texels_within(limit: u64) -> u64 {
    let entries = limit.saturating_sub(1 << 20) / 12;
    if entries < 2 { 1 } else { 1 << entries.ilog2() }
}

impl Tables {
    /// Fills both buffers and the addresses in `view`.
    pub(crate) fn build(
        view: &mut ViewRecord,
        materials: &[MaterialRecord],
        textures: Textures,
        lights: &Lights,
        environment: Option<&PackedEnvironment>,
    ) -> Tables {
        let has_coats = materials.iter().any(|material| material.flags & material_flags::COAT != 0);
        let mut tables = Tables { rows: Vec::new(), texels: textures.words };
        view.materials = tables.append(bytemuck::cast_slice(materials));
        view.textures = tables.append(bytemuck::cast_slice(&textures.records));
        view.lights = tables.append(bytemuck::cast_slice(&lights.records));
        view.punctuals = tables.append(bytemuck::cast_slice(&lights.punctuals));
        view.light_alias = tables.append_alias(&lights.alias);
        view.light_alias_log2 = lights.alias.log2_columns;
        view.coat_albedo = tables.append(bytemuck::cast_slice(if has_coats { coat::table() } else { &[] }));
        view.environment_selection = lights.environment_selection;
        view.srgb_decoding = tables.texels.len() as u32;
        tables.texels.extend((0..=255).map(|byte| (srgb_to_linear(byte) as f32).to_bits()));
        if let Some((map, alias)) = environment.and_then(|map| Some((map, map.alias.as_ref()?))) {
            (view.environment_width, view.environment_height) = (map.width, map.height);
            view.environment_texels = tables.texels.len() as u32;
            tables.texels.extend(map.texels.iter().flatten().map(|value| value.to_bits()));
            view.environment_alias = tables.append_alias(alias);
            view.environment_alias_log2 = alias.log2_columns;
            let pmf: Vec<u32> = (0..alias.columns.len()).map(|entry| (alias.pmf(entry) as f32).to_bits()).collect();
            view.environment_pmf = tables.append(&pmf);
            let rows: Vec<u32> = map.rows.iter().flat_map(|[a, b, c]| [a.to_bits(), b.to_bits(), c.to_bits(), 0]).collect();
            view.environment_rows = tables.append(&rows);
        }
        tables
    }

    /// Copies words to the next free row and returns that row.
    pub(crate) fn append(&mut self, words: &[u32]) -> u32 {
        let first = self.rows.len() as u32;
        self.rows.extend(words.chunks(4).map(|chunk| std::array::from_fn(|i| chunk.get(i).copied().unwrap_or(0))));
        first
    }

    /// Two columns per row.
    fn append_alias(&mut self, alias: &AliasTable) -> u32 {
        self.append(alias.columns.as_flattened())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: a table that begins inside of another's last row.
    #[test]
    fn tables_do_not_share_rows() {
        let mut tables = Tables::default();
        assert_eq!((tables.append(&[1, 2, 3, 4, 5]), tables.append(&[6]), tables.append(&[])), (0, 2, 3));
        assert_eq!(tables.rows, [[1, 2, 3, 4], [5, 0, 0, 0], [6, 0, 0, 0]]);
    }

    // Kills: a limit that refuses 4096 x 2048 within 128 MiB, or accepts what does not fit.
    #[test]
    fn a_large_panorama_fits_a_binding() {
        assert_eq!(environment_texels_within(128 << 20), 4096 * 2048);
        assert_eq!(environment_texels_within(0), 1);
    }
}
