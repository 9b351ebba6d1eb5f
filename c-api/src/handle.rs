//! Handles: what the caller holds is a number that looks like a pointer and is never followed.
//!
//! Each is looked up in a table. So a handle of another kind, one that was freed and one that never was are told apart and refused. Freeing
//! a handle while another thread works with it only takes effect when that is done.
//!
//! Every lock here is held behind [`fork::prevent`], so that a forked process can go on with the handles it has.

use std::any::Any;
use std::borrow::Borrow;
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, DefaultHasher};
use std::ops::Deref;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, PoisonError, RwLock};

use surfrecon::context::Owned;

use crate::status::{Failure, srf_status::*};
use crate::{fork, pointer};

/// A kind of handle.
pub trait Handle {
    /// The thing it stands for.
    type Inner: Send + Sync + 'static;
    /// Name in the header.
    const NAME: &'static str;
}

/// The thing that a handle stands for. It is read by cloning the inner pointer, and changed by replacing or making it unique. So a call
/// that works with it on another thread goes on with the state it began with.
type Slot<T> = RwLock<Shared<T>>;

/// The thing that a handle stands for, as long as somebody works with it.
pub struct Shared<T>(Arc<Owned<T>>);

impl<T> Clone for Shared<T> {
    fn clone(&self) -> Self {
        Shared(self.0.clone())
    }
}

impl<T> Deref for Shared<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T> AsRef<T> for Shared<T> {
    fn as_ref(&self) -> &T {
        &self.0
    }
}

impl<T> Borrow<T> for Shared<T> {
    fn borrow(&self) -> &T {
        &self.0
    }
}

type Table = HashMap<usize, (&'static str, Arc<dyn Any + Send + Sync>), BuildHasherDefault<DefaultHasher>>;

static NEXT: AtomicUsize = AtomicUsize::new(1);

/// Beginning of the numbers of this copy of the library. A program may have loaded several, and none must take another's handles for its
/// own. Copies lie at different addresses, far enough apart for 2^32 handles each.
fn base() -> usize {
    (&raw const NEXT).addr() << 16
}

static TABLE: RwLock<Table> = RwLock::new(HashMap::with_hasher(BuildHasherDefault::new()));

fn slot<H: Handle>(name: &str, handle: *const H) -> Result<Arc<Slot<H::Inner>>, Failure> {
    if handle.is_null() {
        return Err(Failure::new(SRF_ERR_NULL, format!("{name} must not be NULL")));
    }
    let table = TABLE.read().unwrap_or_else(PoisonError::into_inner);
    let Some((kind, slot)) = table.get(&handle.addr()) else {
        let text = format!("{name} is not a handle of this library, or one that was freed");
        return Err(Failure::new(SRF_ERR_HANDLE, text));
    };
    slot.clone()
        .downcast()
        .map_err(|_| Failure::new(SRF_ERR_HANDLE, format!("{name} must be a {}, got a {kind}", H::NAME)))
}

/// The thing that a handle stands for. It lives as long as the answer does, even if the handle is freed meanwhile.
pub fn get<H: Handle>(name: &str, handle: *const H) -> Result<Shared<H::Inner>, Failure> {
    let _fork = fork::prevent();
    Ok(slot(name, handle)?.read().unwrap_or_else(PoisonError::into_inner).clone())
}

/// Changes the thing that a handle stands for. Unchanged if `change` fails. The former thing may be the caller's to release, in a function
/// that calls this library. So `change` must drop nothing of that kind, but hand it back.
pub fn change<H: Handle, R>(
    name: &str,
    handle: *const H,
    change: impl FnOnce(&mut H::Inner) -> Result<R, Failure>,
) -> Result<R, Failure>
where
    H::Inner: Clone,
{
    let slot = {
        let _fork = fork::prevent();
        slot(name, handle)?
    };
    let (changed, former) = {
        let _fork = fork::prevent();
        let mut inner = slot.write().unwrap_or_else(PoisonError::into_inner);
        // Another thread may work with what it stood for, and be done with that just now.
        let former = (Arc::strong_count(&inner.0) > 1).then(|| {
            let copy = Shared(Arc::new(Owned::clone(&inner.0)));
            std::mem::replace(&mut *inner, copy)
        });
        let owned: &mut Owned<H::Inner> = Arc::make_mut(&mut inner.0);
        (change(owned), former)
    };
    drop((former, slot));
    changed
}

/// Makes a handle and writes it to the caller.
pub fn give<H: Handle>(name: &str, out: *mut *mut H, inner: H::Inner) -> Result<(), Failure> {
    give_numbered(name, out, |_| Ok(inner))
}

/// [`give`] for what wants to know the number of its handle.
pub fn give_numbered<H: Handle>(
    name: &str,
    out: *mut *mut H,
    make: impl FnOnce(usize) -> Result<H::Inner, Failure>,
) -> Result<(), Failure> {
    pointer::writable(name, out)?;
    // Multiples of 16 like addresses of objects; never NULL, never one that was freed.
    let number = base().wrapping_add(NEXT.fetch_add(1, Ordering::Relaxed) * 16);
    let slot: Arc<Slot<H::Inner>> = Arc::new(RwLock::new(Shared(Arc::new(Owned::new(make(number)?)))));
    {
        let _fork = fork::prevent();
        TABLE.write().unwrap_or_else(PoisonError::into_inner).insert(number, (H::NAME, slot));
    }
    pointer::write(name, out, std::ptr::without_provenance_mut(number))
}

/// Ends a handle. NULL is fine.
pub fn free<H: Handle>(name: &str, handle: *mut H) -> Result<(), Failure> {
    if handle.is_null() {
        return Ok(());
    }
    get(name, handle.cast_const())?;
    let ended = {
        let _fork = fork::prevent();
        TABLE.write().unwrap_or_else(PoisonError::into_inner).remove(&handle.addr())
    };
    // The thing it stood for is dropped after the table is free for others again.
    drop(ended);
    Ok(())
}

/// Ends a handle that was handed over. Returns the thing it stood for.
pub fn take<H: Handle>(name: &str, handle: *mut H) -> Result<H::Inner, Failure>
where
    H::Inner: Clone,
{
    let inner = get(name, handle.cast_const())?;
    free(name, handle)?;
    // Copied only where another thread works with it still.
    Ok(Arc::unwrap_or_clone(inner.0).into_inner())
}

/// Makes an opaque type of the header a kind of handle.
macro_rules! handle {
    ($name:ident, $inner:ty) => {
        impl $crate::handle::Handle for $name {
            type Inner = $inner;
            const NAME: &'static str = stringify!($name);
        }
    };
}
pub(crate) use handle;
