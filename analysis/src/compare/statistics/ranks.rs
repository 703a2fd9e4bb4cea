//! Ranks of values: the least value has rank 1, and equal values share their mean rank.

#[must_use]
pub fn ranks(values: &[f64]) -> Vec<f64> {
    let mut ranks = vec![0.0; values.len()];
    for group in groups(values) {
        // 1 + the mean of the positions.
        let rank = 1.0 + (group.from as f64 + (group.from + group.members.len() - 1) as f64) / 2.0;
        for place in group.members {
            ranks[place] = rank;
        }
    }
    ranks
}

/// Returns Σ t³ - t over the groups of t equal values.
#[must_use]
pub fn ties(values: &[f64]) -> f64 {
    let sizes = groups(values)
        .into_iter()
        .map(|group| group.members.len() as f64);
    sizes.map(|t| t * t * t - t).sum()
}

struct Group {
    /// The number of smaller values.
    from: usize,
    /// The indices of the values.
    members: Vec<usize>,
}

fn groups(values: &[f64]) -> Vec<Group> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut groups = Vec::new();
    let mut from = 0;
    for members in order.chunk_by(|a, b| values[*a] == values[*b]) {
        groups.push(Group {
            from,
            members: members.to_vec(),
        });
        from += members.len();
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_values_share_their_ranks() {
        assert_eq!(ranks(&[30.0, 10.0, 20.0, 10.0]), [4.0, 1.5, 3.0, 1.5]);
        assert_eq!(ranks(&[]), [0.0; 0]);
        // One group of two values: 8 - 2; one of three: 27 - 3.
        assert_eq!(ties(&[1.0, 1.0, 2.0, 3.0, 3.0, 3.0]), 30.0);
        assert_eq!(ties(&[1.0, 2.0]), 0.0);
    }
}
