//! What lies beyond an image's edges.

use serde::Serialize;

/// What lies beyond an image's edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
pub enum Border {
    /// The image mirrored at its outermost pixels, which are not repeated: `c b | a b c | b a`.
    #[default]
    Mirror,
    /// The outermost pixels again and again: `a a | a b c | c c`.
    Clamp,
    /// Nothing: weights are normalised over what is inside.
    Renormalize,
}

impl Border {
    /// The position inside `0..size` that stands for `position`; none where nothing does. `size` is at least one.
    pub fn map(self, position: i64, size: usize) -> Option<usize> {
        let size = size as i64;
        if (0..size).contains(&position) {
            return Some(position as usize);
        }
        match self {
            Self::Mirror if size == 1 => Some(0),
            Self::Mirror => {
                let period = 2 * (size - 1);
                let folded = position.rem_euclid(period);
                Some(if folded < size { folded } else { period - folded } as usize)
            }
            Self::Clamp => Some(position.clamp(0, size - 1) as usize),
            Self::Renormalize => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_beyond_the_edges() {
        let row = |border: Border, size| (-5..8).map(|i| border.map(i, size)).collect::<Vec<_>>();
        let some = |v: &[usize]| v.iter().map(|&i| Some(i)).collect::<Vec<_>>();
        assert_eq!(row(Border::Mirror, 3), some(&[1, 0, 1, 2, 1, 0, 1, 2, 1, 0, 1, 2, 1]));
        assert_eq!(row(Border::Mirror, 1), some(&[0; 13]));
        assert_eq!(row(Border::Clamp, 3), some(&[0, 0, 0, 0, 0, 0, 1, 2, 2, 2, 2, 2, 2]));
        let renormalize = row(Border::Renormalize, 3);
        assert_eq!(renormalize.iter().filter(|p| p.is_some()).count(), 3);
    }
}
