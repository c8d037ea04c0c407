//! Numbers whose readers compute with them, so that what they arrive at is what was meant.

/// `near`, or the float among its four neighbours on either side that `read` takes to the very bits of `wanted`.
pub(super) fn reads_back_as(wanted: f32, near: f32, read: impl Fn(f32) -> f32) -> f32 {
    let mut candidates = vec![near];
    let (mut below, mut above) = (near, near);
    for _ in 0..4 {
        (below, above) = (below.next_down(), above.next_up());
        candidates.extend([below, above]);
    }
    candidates.into_iter().find(|&candidate| read(candidate) == wanted).unwrap_or(near)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_neighbour_is_taken_where_the_nearest_reads_otherwise() {
        let (mut hit, mut nearest) = (0, 0);
        for i in 1..1000 {
            // The square of a float near it: its root need not square back to it.
            let root = i as f32 * 0.01;
            let wanted = root.recip();
            let near = wanted.recip().next_up();
            hit += usize::from(reads_back_as(wanted, near, f32::recip).recip() == wanted);
            nearest += usize::from(near.recip() == wanted);
        }
        assert!(hit == 999 && nearest < 999, "{hit} {nearest}");
    }
}
