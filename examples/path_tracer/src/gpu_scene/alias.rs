//! Tables that pick an entry with an exactly known probability from two random words.
//!
//! Key decision: weights become integers that add up to 2^(32 + k) first, and Walker's construction then runs on integers, so there is
//! nothing left over to round. The probability that a kernel divides by is the one its draw realises.
//! Source: Walker, 1974; Vose, 1991.
//!
//! **Invariant:** an entry of weight zero is never picked, and the counts of all entries add up to 2^(32 + k).

/// An alias table over a power of two of columns, the last ones perhaps without weight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AliasTable {
    /// The number of columns is 2 to this; at least 1.
    pub log2_columns: u32,
    /// Threshold and other entry per column: the column itself is picked when the second random word is below the threshold.
    pub columns: Vec<[u32; 2]>,
    /// Of 2^(32 + k) pairs of words, how many pick the entry.
    pub counts: Vec<u64>,
}

const FULL: u64 = 1 << 32;

impl AliasTable {
    /// From weights that are finite and not negative; `None` when all are zero.
    ///
    /// **Cost:** linear in the number of weights.
    pub fn new(weights: &[f64]) -> Option<AliasTable> {
        let log2_columns = weights.len().max(2).next_power_of_two().trailing_zeros();
        let columns = 1usize << log2_columns;
        let counts = integer_counts(weights, columns)?;
        let mut table = AliasTable { log2_columns, columns: vec![[0, 0]; columns], counts };
        let mut left = table.counts.clone();
        let (mut poor, mut rich): (Vec<usize>, Vec<usize>) = (0..columns).partition(|&column| left[column] < FULL);
        while let Some(column) = poor.pop() {
            // Counts add up to the columns' capacity, so while one is poor another is rich.
            let Some(&donor) = rich.last() else { break };
            table.columns[column] = [left[column] as u32, donor as u32];
            left[donor] -= FULL - left[column];
            if left[donor] < FULL {
                rich.pop();
                poor.push(donor);
            }
        }
        for column in rich {
            table.columns[column] = [u32::MAX, column as u32];
        }
        Some(table)
    }

    /// The realised probability of an entry.
    pub fn pmf(&self, entry: usize) -> f64 {
        self.counts[entry] as f64 / (FULL as f64 * self.columns.len() as f64)
    }
}

/// Rounds the weights to integers with the sum `columns << 32`; the largest weight takes what rounding leaves.
fn integer_counts(weights: &[f64], columns: usize) -> Option<Vec<u64>> {
    let largest = weights.iter().copied().fold(0.0, f64::max);
    if largest <= 0.0 || !largest.is_finite() {
        return None;
    }
    // Divided first, so that the sum of very large weights stays finite.
    let sum: f64 = weights.iter().map(|weight| weight / largest).sum();
    let total = (columns as u64) << 32;
    let mut counts: Vec<u64> = weights.iter().map(|weight| (weight / largest / sum * total as f64).round() as u64).collect();
    let counted: u64 = counts.iter().sum();
    let first_largest = weights.iter().position(|&weight| weight == largest)?;
    counts[first_largest] = (counts[first_largest] + total).checked_sub(counted)?;
    counts.resize(columns, 0);
    Some(counts)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many pairs of words pick each entry, counted column by column.
    fn enumerate(table: &AliasTable) -> Vec<u64> {
        let mut counts = vec![0u64; table.columns.len()];
        for (column, &[threshold, other]) in table.columns.iter().enumerate() {
            counts[column] += u64::from(threshold);
            counts[other as usize] += FULL - u64::from(threshold);
        }
        counts
    }

    fn weights(count: usize) -> Vec<f64> {
        (0..count).map(|i| if i % 3 == 0 { 0.0 } else { 1.0 / (1.0 + (i * 7919 % 104_729) as f64) }).collect()
    }

    // Kills: a threshold rounded on its own, an alias to the wrong donor, a padding entry that can be picked.
    #[test]
    fn the_draw_realises_the_stored_probability() {
        for count in [1, 2, 3, 7, 64, 1000, 1 << 16] {
            let weights: Vec<f64> = weights(count).into_iter().map(|weight| weight + f64::from(u8::from(count < 2))).collect();
            let table = AliasTable::new(&weights).expect("positive weights");
            assert_eq!(enumerate(&table), table.counts, "{count}");
            assert_eq!(table.counts.iter().sum::<u64>(), FULL << table.log2_columns);
        }
    }

    // Kills: a column without weight that was left full at the end.
    #[test]
    fn weight_zero_is_never_picked() {
        let weights = weights(4097);
        let table = AliasTable::new(&weights).expect("positive weights");
        for (entry, &count) in table.counts.iter().enumerate() {
            assert_eq!(count == 0, weights.get(entry).is_none_or(|&weight| weight == 0.0), "{entry}");
        }
    }

    // Kills: a sum that overflows, a sun that swallows every other entry of a large table by rounding.
    #[test]
    fn a_sun_leaves_the_sky_its_share() {
        let mut weights = vec![1.0; 1 << 16];
        weights[12345] = 1e9;
        let table = AliasTable::new(&weights).expect("positive weights");
        let sum = 1e9 + 65535.0;
        assert!((table.pmf(0) * sum - 1.0).abs() < 1e-4, "{}", table.pmf(0) * sum);
        assert!((table.pmf(12345) * sum / 1e9 - 1.0).abs() < 1e-9);
        assert!(AliasTable::new(&[1e308, 1e308]).is_some());
    }

    // Kills: a table made of nothing.
    #[test]
    fn without_weight_there_is_no_table() {
        assert_eq!(AliasTable::new(&[]), None);
        assert_eq!(AliasTable::new(&[0.0, 0.0]), None);
    }
}
