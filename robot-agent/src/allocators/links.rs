//! Links between the robots of a test team, as `links[from][to]`.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Links the robots along a line, with a share `more` of random additional links.
pub fn connect_as_line(links: &mut [Vec<bool>], more: f64, chance: &mut ChaCha8Rng) {
    let count = links.len();
    let pairs = (0..count).flat_map(|from| (0..from).map(move |to| (from, to)));
    for (from, to) in pairs {
        let linked = from - to == 1 || chance.random_bool(more);
        links[from][to] = linked;
        links[to][from] = linked;
    }
}

/// Returns the largest distance between two robots, in links.
pub fn diameter(links: &[Vec<bool>]) -> usize {
    let count = links.len();
    let distance = |from: usize, to: usize| match links[from][to] {
        _ if from == to => 0,
        true => 1,
        false => count,
    };
    let row = |from| (0..count).map(|to| distance(from, to)).collect();
    let mut away: Vec<Vec<usize>> = (0..count).map(row).collect();
    for by in 0..count {
        for from in 0..count {
            for to in 0..count {
                away[from][to] = away[from][to].min(away[from][by] + away[by][to]);
            }
        }
    }
    away.into_iter().flatten().max().unwrap()
}
