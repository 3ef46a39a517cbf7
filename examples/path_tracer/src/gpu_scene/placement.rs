//! Where the rows of a scene lie: in storage buffers, or, of a small scene on a software driver, in uniform buffers.
//!
//! Key decision: the same rows under the same bindings, so that a kernel differs in three declarations and in what a row is read as. Mesa's
//! software driver reads a storage buffer lane by lane, with a branch for the lane and another for the bounds of each word; from a uniform buffer
//! it gathers without a branch, and two words at once where they are one number of 64 bits. A GPU wants the opposite: its uniform memory
//! is made for lanes that all read the same.
//!
//! **Invariant:** bits do not depend on the placement; a row is the same four words. A buffer in uniform memory has a power of two of rows, so that
//! scenes of about a size share kernels.

/// Bytes of a row.
const ROW: usize = 16;

/// Rows that a uniform buffer has for these bytes: the next power of two.
fn rows_for(bytes: usize) -> usize {
    bytes.div_ceil(ROW).next_power_of_two()
}

/// Whether all of these buffers fit into uniform bindings of `limit` bytes.
pub(crate) fn is_uniform(buffers: &[&Vec<u8>], limit: u64) -> bool {
    buffers.iter().all(|bytes| (rows_for(bytes.len()) * ROW) as u64 <= limit)
}

/// Fills a buffer up to its rows and says how many these are.
pub(crate) fn fill(bytes: &mut Vec<u8>) -> u32 {
    let rows = rows_for(bytes.len());
    bytes.resize(rows * ROW, 0);
    rows as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: a limit that is compared before filling up, a last row that is cut off, one scene that is too large and is not noticed.
    #[test]
    fn what_is_filled_up_fits() {
        let sizes = |sizes: &[usize]| sizes.iter().map(|&size| vec![1_u8; size]).collect::<Vec<_>>();
        let fit = |buffers: &[Vec<u8>], limit| is_uniform(&buffers.iter().collect::<Vec<_>>(), limit);
        assert!(fit(&sizes(&[16, 33 * 16, 1024]), 1024));
        assert!(!fit(&sizes(&[16, 33 * 16, 1024]), 1023));
        assert!(!fit(&sizes(&[16, 1040]), 2000), "1040 bytes are 65 rows, which are filled up to 128");
        assert!(!fit(&sizes(&[32]), 0));
        let mut bytes = vec![7; 49];
        assert_eq!((fill(&mut bytes), bytes.len(), bytes[48], bytes[49]), (4, 64, 7, 0));
    }
}
