//! A history of fixed size that gets coarser as it gets longer.

/// One of several kept values, of the whole time.
#[derive(Clone, Debug)]
pub struct Thinned<T> {
    pub kept: Vec<T>,
    /// Every so many is kept.
    stride: usize,
    until_next: usize,
    capacity: usize,
}

impl<T: Clone> Thinned<T> {
    pub const fn new(capacity: usize) -> Self {
        Self { kept: Vec::new(), stride: 1, until_next: 0, capacity }
    }

    pub fn push(&mut self, value: T) {
        if self.until_next > 0 {
            self.until_next -= 1;
            return;
        }
        if self.kept.len() >= self.capacity {
            let mut place = 0;
            self.kept.retain(|_| {
                place += 1;
                place % 2 == 1
            });
            self.stride *= 2;
        }
        self.kept.push(value);
        self.until_next = self.stride - 1;
    }

    pub fn clear(&mut self) {
        *self = Self::new(self.capacity);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_spans_all_time_in_bounded_room() {
        let mut history = Thinned::new(8);
        for i in 0..8 {
            history.push(i);
        }
        assert_eq!(history.kept, [0, 1, 2, 3, 4, 5, 6, 7]);
        for i in 8..1000 {
            history.push(i);
            assert!(history.kept.len() <= 8);
        }
        let kept = &history.kept;
        assert_eq!(kept[0], 0);
        assert!(kept.windows(2).all(|pair| pair[1] - pair[0] == kept[1]), "{kept:?}");
        assert!(*kept.last().unwrap() > 800, "{kept:?}");
    }
}
