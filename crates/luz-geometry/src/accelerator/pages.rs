//! Large arrays on large pages of memory.

use std::marker::PhantomData;
use std::ops::Deref;

use bytemuck::Pod;
use memmap2::MmapMut;

/// An array that, where it is large and the system can, lies on huge pages: rays jump about in it, and with small pages
/// most of their time would go into translating addresses.
#[derive(Debug)]
pub(super) enum Pages<T> {
    Small(Vec<T>),
    Large(MmapMut, PhantomData<T>),
}

impl<T> Default for Pages<T> {
    fn default() -> Self {
        Self::Small(Vec::new())
    }
}

impl<T: Pod> From<Vec<T>> for Pages<T> {
    fn from(mut items: Vec<T>) -> Self {
        const LARGE: usize = 4 << 20;
        let bytes: &[u8] = bytemuck::cast_slice(&items);
        if cfg!(target_os = "linux")
            && bytes.len() >= LARGE
            && let Ok(mut map) = MmapMut::map_anon(bytes.len())
        {
            // Without huge pages it works as well, only slower.
            #[cfg(target_os = "linux")]
            let _ = map.advise(memmap2::Advice::HugePage);
            map.copy_from_slice(bytes);
            if bytemuck::try_cast_slice::<u8, T>(&map).is_ok() {
                return Self::Large(map, PhantomData);
            }
        }
        items.shrink_to_fit();
        Self::Small(items)
    }
}

impl<T: Pod> Deref for Pages<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        match self {
            Self::Small(items) => items,
            Self::Large(map, _) => bytemuck::cast_slice(map),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_and_large_arrays_hold_what_was_put_in() {
        for n in [0u64, 3, 1 << 20] {
            let items: Vec<u64> = (0..n).map(|i| i * i).collect();
            assert_eq!(&Pages::from(items.clone())[..], &items[..]);
        }
    }
}
