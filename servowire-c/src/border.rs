//! What comes over the border: pointers, and states in the memory of the caller.
//!
//! The only `unsafe` that looks at the caller's memory is in this file. A pointer to one value is an `Option<&T>` in the
//! signature: the compiler makes NULL a `None`, and the caller vouches for the rest, as he does for every C function. What is
//! only written is `MaybeUninit`.

use core::mem::MaybeUninit;

use crate::result::{sw_code_t, sw_result_t};

/// A refusal on the way to a result.
pub(crate) type Refused = sw_result_t;

/// The body of a function: its refusals leave by `?`.
#[inline(always)]
pub(crate) fn border(body: impl FnOnce() -> Result<sw_result_t, Refused>) -> sw_result_t {
    match body() {
        Ok(result) | Err(result) => result,
    }
}

pub(crate) const OK: Result<sw_result_t, Refused> = Ok(sw_code_t::SW_OK as sw_result_t);

/// A pointer that must not be NULL.
#[inline(always)]
pub(crate) fn there<T>(pointer: Option<T>) -> Result<T, Refused> {
    pointer.ok_or(sw_code_t::SW_E_NULL as sw_result_t)
}

/// An argument that is out of range.
#[inline(always)]
pub(crate) fn in_range<T>(value: Option<T>) -> Result<T, Refused> {
    value.ok_or(sw_code_t::SW_E_ARGUMENT as sw_result_t)
}

/// Memory of the caller from which `len` values are read.
///
/// # Safety
/// `start` is NULL, or there are `len` values, which nobody writes during the call.
#[inline(always)]
pub(crate) unsafe fn read<'a, T>(start: *const T, len: usize) -> Result<&'a [T], Refused> {
    check(start, len)?;
    // SAFETY: not NULL, aligned and no longer than memory can be; the caller vouches for the values.
    Ok(unsafe { core::slice::from_raw_parts(start, len) })
}

/// Memory of the caller into which at most `size` values are written.
///
/// # Safety
/// `start` is NULL, or there is room for `size` values, which nobody else looks at during the call.
#[inline(always)]
pub(crate) unsafe fn room<'a, T>(start: *mut T, size: usize) -> Result<&'a mut [MaybeUninit<T>], Refused> {
    check(start, size)?;
    // SAFETY: not NULL, aligned and no longer than memory can be; what is not initialised is not read.
    Ok(unsafe { core::slice::from_raw_parts_mut(start.cast(), size) })
}

/// The first `want` values of a caller's buffer of `size`, cleared: for what writes into values that are there.
///
/// # Safety
/// As for [`room`].
#[inline(always)]
pub(crate) unsafe fn cleared<'a, T: Copy + Default>(
    start: *mut T,
    size: usize,
    want: usize,
) -> Result<&'a mut [T], Refused> {
    // SAFETY: the caller vouches for it.
    let room = unsafe { room::<T>(start, size)? };
    let room = room.get_mut(..want).ok_or(sw_code_t::SW_E_SHORT_BUFFER as sw_result_t)?;
    for place in room.iter_mut() {
        place.write(T::default());
    }
    // SAFETY: every value has just been written.
    Ok(unsafe { core::slice::from_raw_parts_mut(room.as_mut_ptr().cast(), room.len()) })
}

#[inline(always)]
fn check<T>(start: *const T, len: usize) -> Result<(), Refused> {
    if start.is_null() {
        return Err(sw_code_t::SW_E_NULL as sw_result_t);
    }
    if len.saturating_mul(size_of::<T>()) > isize::MAX as usize || !start.is_aligned() {
        return Err(sw_code_t::SW_E_ARGUMENT as sw_result_t);
    }
    Ok(())
}

/// Writes all of `from` to the front of `to`, or nothing.
#[inline]
pub(crate) fn fill<T: Copy>(to: &mut [MaybeUninit<T>], from: &[T]) -> Result<(), Refused> {
    let to = to.get_mut(..from.len()).ok_or(sw_code_t::SW_E_SHORT_BUFFER as sw_result_t)?;
    for (to, from) in to.iter_mut().zip(from) {
        to.write(*from);
    }
    Ok(())
}

/// Decodes the caller's bytes: the value is written if there is one.
///
/// # Safety As for [`read`].
#[inline(always)]
pub(crate) unsafe fn parsed<T>(
    bytes: *const u8,
    len: usize,
    out: Option<&mut MaybeUninit<T>>,
    parse: impl FnOnce(&[u8]) -> Result<T, Refused>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller vouches for it.
        let (bytes, out) = (unsafe { read(bytes, len)? }, there(out)?);
        out.write(parse(bytes)?);
        OK
    })
}

/// The first `N` bytes of a caller's buffer, to be written whole.
///
/// # Safety
/// As for [`room`].
#[inline(always)]
pub(crate) unsafe fn block<'a, const N: usize>(
    bytes: *mut u8,
    size: usize,
) -> Result<&'a mut MaybeUninit<[u8; N]>, Refused> {
    if bytes.is_null() {
        return Err(sw_code_t::SW_E_NULL as sw_result_t);
    }
    if size < N {
        return Err(sw_code_t::SW_E_SHORT_BUFFER as sw_result_t);
    }
    // SAFETY: not NULL and long enough; bytes have no alignment, and what is not initialised is not read.
    Ok(unsafe { &mut *bytes.cast() })
}

/// Encodes a block of constant length into the caller's buffer.
///
/// # Safety
/// As for [`room`].
#[inline(always)]
pub(crate) unsafe fn filled<const N: usize>(
    bytes: *mut u8,
    size: usize,
    make: impl FnOnce() -> Result<[u8; N], Refused>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller vouches for it.
        let bytes = unsafe { block(bytes, size)? };
        bytes.write(make()?);
        OK
    })
}

/// Encodes something of any length into the caller's buffer, and says how long it is.
///
/// # Safety
/// As for [`room`].
#[inline(always)]
pub(crate) unsafe fn given<T>(
    bytes: *mut u8,
    size: usize,
    len: Option<&mut MaybeUninit<usize>>,
    make: impl FnOnce() -> Result<T, Refused>,
    as_bytes: impl FnOnce(&T) -> &[u8],
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller vouches for it.
        let (bytes, len) = (unsafe { room(bytes, size)? }, there(len)?);
        let made = make()?;
        let from = as_bytes(&made);
        fill(bytes, from)?;
        len.write(from.len());
        OK
    })
}

/// What stands in the memory of a state: a mark that `start` writes, and the state.
#[repr(C)]
pub(crate) struct Started<T> {
    pub(crate) mark: u32,
    pub(crate) state: T,
}

/// Returns where in the memory of a C type its state stands: at the beginning, unless the state wants more than 8 bytes of alignment, which only
/// hosts ask for.
#[inline(always)]
pub(crate) fn place<C, T>(memory: *mut C) -> *mut Started<T> {
    let begin = memory.cast::<u8>();
    let ahead =
        if align_of::<Started<T>>() <= align_of::<C>() { 0 } else { begin.align_offset(align_of::<Started<T>>()) };
    begin.wrapping_add(ahead).cast()
}

/// Gives a C type of fixed size, `[u64; K]`, the state that lives in it.
///
/// A layout of Rust may change with the compiler, so the size is compared by `<=` with a tenth as margin. A state that is `pinned` is
/// never copied, so it may stand at any place of its memory. The mark is a byte of which no other state has the same.
macro_rules! state {
    ($c:ty, $rust:ty, $mark:literal) => {
        const _: () = {
            use $crate::border::Started;
            assert!(align_of::<Started<$rust>>() <= align_of::<$c>(), "a copy would be aligned in another way");
        };
        $crate::border::state!(pinned $c, $rust, $mark);
    };
    (pinned $c:ty, $rust:ty, $mark:literal) => {
        const _: () = {
            use $crate::border::Started;
            let size = size_of::<Started<$rust>>();
            let all = size.saturating_add(size / 10).saturating_add(align_of::<Started<$rust>>().saturating_sub(align_of::<$c>()));
            assert!(all <= size_of::<$c>(), "the C type is too small");
            assert!(!core::mem::needs_drop::<$rust>(), "C forgets a state without a word");
        };

        impl $c {
            /// Four equal bytes, which a Cortex-M compares in one instruction.
            pub(crate) const MARK: u32 = u32::from_le_bytes([$mark; 4]);

            /// Puts a state in place.
            #[inline(always)]
            pub(crate) fn start(
                this: Option<&mut core::mem::MaybeUninit<Self>>,
                state: $rust,
            ) -> Result<(), $crate::border::Refused> {
                let place = $crate::border::place::<_, $rust>($crate::border::there(this)?.as_mut_ptr());
                // SAFETY: the memory is the caller's, large enough and aligned, as asserted above. Written one by one, which spares a copy.
                unsafe {
                    core::ptr::addr_of_mut!((*place).mark).write(Self::MARK);
                    core::ptr::addr_of_mut!((*place).state).write(state);
                }
                Ok(())
            }

            /// The state, if it was started.
            #[inline(always)]
            pub(crate) fn get(this: Option<&mut Self>) -> Result<&mut $rust, $crate::border::Refused> {
                let place = $crate::border::place::<_, $rust>(core::ptr::from_mut($crate::border::there(this)?));
                // SAFETY: large enough and aligned, as asserted above. The mark is a plain number.
                let mark = unsafe { core::ptr::addr_of!((*place).mark).read() };
                if mark != Self::MARK {
                    return Err($crate::result::sw_code_t::SW_E_STATE as $crate::result::sw_result_t);
                }
                // SAFETY: `start` has put the mark and a state there, and the caller has left it alone or copied it whole.
                Ok(unsafe { &mut (*place).state })
            }

            /// The state to look at, if it was started.
            #[inline(always)]
            #[allow(dead_code, reason = "not every state is only looked at")]
            pub(crate) fn look(this: Option<&Self>) -> Result<&$rust, $crate::border::Refused> {
                let memory = core::ptr::from_ref($crate::border::there(this)?).cast_mut();
                let place = $crate::border::place::<_, $rust>(memory).cast_const();
                // SAFETY: as in `get`.
                let mark = unsafe { core::ptr::addr_of!((*place).mark).read() };
                if mark != Self::MARK {
                    return Err($crate::result::sw_code_t::SW_E_STATE as $crate::result::sw_result_t);
                }
                // SAFETY: as in `get`.
                Ok(unsafe { &(*place).state })
            }
        }
    };
}
pub(crate) use state;
