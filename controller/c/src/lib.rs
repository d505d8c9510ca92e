//! Your own control law in a ringwing flight, in C, C++ or any language that calls C.
//!
//! [`types`] are the structs of the header `ringwing.h`, and `foreign` fills them in. What runs is the crate
//! `ringwing-controller`, as for a law in Rust.
//!
//! Never lets a panic or an exception cross the boundary between the languages.

mod foreign;
pub mod types;

use foreign::Foreign;
use ringwing_controller::{PeerTrack, Pose, RunError, Tick, run};
use std::{
    ffi::{CStr, OsStr, OsString, c_char, c_int, c_void},
    io::{Write, stderr},
    os::unix::ffi::OsStrExt,
    panic::{AssertUnwindSafe, catch_unwind},
};
use types::{RingwingCallbacks, RingwingPose, RingwingTrack};

/// The exit code of Rust's own `main` after a panic.
const PANICKED: c_int = 101;
/// The exit code of a program that uses the interface wrongly, as of one with wrong arguments.
const MISUSED: c_int = 2;

/// Flies a UAV with the callbacks of the program until the flight ends; to be called once, from main, with the arguments of main.
///
/// Returns the exit code for main: 0 after the flight, 1 if the program cannot take part in the run, 2 if the arguments do
/// not name a run, or if `size_bytes` is not that of this version or step is NULL. What is wrong is on standard error. `user` is
/// passed on to the callbacks and may be NULL.
///
/// # Safety
/// `argv` points to `argc` texts that end with a zero, and `callbacks` to a struct that is filled in. The callbacks can be called
/// with `user`.
#[expect(unsafe_code, reason = "the linker has to find the function by its name")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ringwing_controller_main(
    argc: c_int,
    argv: *mut *mut c_char,
    callbacks: *const RingwingCallbacks,
    user: *mut c_void,
) -> c_int {
    // A panic has told what happened by the time it is caught. An exception of C++ that arrives here aborts the process.
    let flown = catch_unwind(AssertUnwindSafe(|| {
        #[expect(unsafe_code, reason = "only the caller knows what the pointers point to")]
        // SAFETY: the caller promises what these functions need.
        let (arguments, callbacks) = unsafe { (arguments_of(argc, argv), callbacks_of(callbacks)) };
        match callbacks {
            Ok(callbacks) => fly(&arguments, argv, callbacks, user),
            Err(why) => say(why),
        }
    }));
    flown.unwrap_or(PANICKED)
}

/// Where an aircraft with this track is after `seconds` more, if it holds its speed and turn rate. A negative number leads
/// back. For where a neighbour is now, pass the age of its track.
#[expect(unsafe_code, reason = "the linker has to find the function by its name")]
#[unsafe(no_mangle)]
pub extern "C" fn ringwing_track_after(track: RingwingTrack, seconds: f64) -> RingwingPose {
    let position_m = track.pose.position_m;
    let pose = Pose { position: [position_m.x, position_m.y].into(), heading_rad: track.pose.heading_rad };
    let flown = PeerTrack {
        tick: Tick(track.tick),
        pose,
        speed_m_s: track.speed_m_s,
        turn_rate_rad_s: track.turn_rate_rad_s,
    };
    foreign::pose(&flown.after(seconds))
}

/// Notes a number for the log under a name, such as `slot_error_m`. To be called by step, as often as there are numbers to note.
///
/// Returns whether the log gets the note, if the flight is recorded. A name has 1 to 32 letters, digits and underscores of ASCII,
/// begins with a letter, and is not tick, `time_s` or uav; a tick has at most 16 notes. Any other note is left out, and the run warns
/// of the first one. A second value under the same name replaces the first one. The value may be NaN or infinite. Notes never
/// change the flight.
///
/// # Safety
/// `name` is NULL, which is no name, or points to a text that ends with a zero.
#[expect(unsafe_code, reason = "the linker has to find the function by its name")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ringwing_note(name: *const c_char, value: f64) -> bool {
    if name.is_null() {
        return foreign::note("", value);
    }
    #[expect(unsafe_code, reason = "only the caller knows what the pointer points to")]
    // SAFETY: the caller promises a text.
    let name = unsafe { CStr::from_ptr(name) };
    foreign::note(&name.to_string_lossy(), value)
}

fn fly(
    arguments: &[OsString],
    argv: *mut *mut c_char,
    callbacks: RingwingCallbacks,
    user: *mut c_void,
) -> c_int {
    let Some(step) = callbacks.step else {
        return say("RingwingCallbacks has no step");
    };
    // The program's own arguments are the first ones after its name. Without a name there are no arguments at all.
    let own = argv.wrapping_add(1).cast_const();
    match run(arguments, |start| Foreign::new(&callbacks, step, user, start, own)) {
        Ok(()) => 0,
        Err(error) => tell(&error),
    }
}

/// The arguments without the name of the program.
///
/// # Safety
/// `argv` points to `argc` texts that end with a zero.
#[expect(unsafe_code, reason = "only the caller knows what the pointers point to")]
unsafe fn arguments_of(argc: c_int, argv: *mut *mut c_char) -> Vec<OsString> {
    let count = usize::try_from(argc).unwrap_or(0);
    // SAFETY: the caller promises `argc` texts.
    let text = |place| unsafe { CStr::from_ptr(*argv.wrapping_add(place)) };
    (1..count).map(|place| OsStr::from_bytes(text(place).to_bytes()).to_owned()).collect()
}

/// What `callbacks` points to, or why it cannot be used.
///
/// # Safety
/// `callbacks` is null or points to a struct of as many bytes as its `size_bytes` says.
#[expect(unsafe_code, reason = "only the caller knows what the pointer points to")]
unsafe fn callbacks_of(callbacks: *const RingwingCallbacks) -> Result<RingwingCallbacks, &'static str> {
    if callbacks.is_null() {
        return Err("callbacks is NULL");
    }
    // SAFETY: `size_bytes` comes first in every version of the struct. Nothing behind it is read before it is known to be there.
    let size_bytes = unsafe { callbacks.cast::<usize>().read() };
    // When the struct grows, the sizes that it had before have to remain valid.
    if size_bytes != size_of::<RingwingCallbacks>() {
        return Err(
            "size_bytes of RingwingCallbacks is not sizeof(RingwingCallbacks) of this version: set it, or \
                    build the program with the header of the library that it runs with",
        );
    }
    // SAFETY: the struct is as large as here.
    Ok(unsafe { callbacks.read() })
}

/// Says why the program cannot fly, as `ringwing_controller::main` does.
fn tell(error: &RunError) -> c_int {
    c_int::from(error.tell())
}

/// Says how the program uses the interface wrongly.
fn say(why: &str) -> c_int {
    // Nobody can be told that nobody reads it.
    let _ = writeln!(stderr(), "error: ringwing_controller_main: {why}");
    MISUSED
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::types::{RingwingSituation, RingwingWish};
    use std::{path::Path, ptr};

    extern "C-unwind" fn straight(_: *mut c_void, _: *const RingwingSituation) -> RingwingWish {
        RingwingWish { speed_m_s: 15.0, turn_rate_rad_s: 0.0 }
    }

    static WHOLE: RingwingCallbacks =
        RingwingCallbacks { size_bytes: size_of::<RingwingCallbacks>(), start: None, step: Some(straight) };

    /// What the entry point returns to a program that was started with `arguments`.
    #[expect(unsafe_code, reason = "the function under test is unsafe")]
    fn called(arguments: &[&CStr], callbacks: *const RingwingCallbacks) -> c_int {
        let mut argv: Vec<*mut c_char> = arguments.iter().map(|text| text.as_ptr().cast_mut()).collect();
        let argc = c_int::try_from(argv.len()).unwrap();
        // SAFETY: the texts end with a zero, and `straight` needs nothing.
        unsafe { ringwing_controller_main(argc, argv.as_mut_ptr(), callbacks, ptr::null_mut()) }
    }

    #[test]
    fn a_wrong_use_of_the_interface_ends_with_code_2_and_flies_nothing() {
        assert_eq!(called(&[c"mine"], ptr::null()), 2);
        assert_eq!(called(&[c"mine"], &raw const WHOLE), 2, "started without a run");
        assert_eq!(called(&[], &raw const WHOLE), 2, "started without even a name");
        let run = [c"mine", c"agent", c"--uav", c"1", c"--domain", c"k3x9ab"];
        assert_eq!(called(&run, &raw const WHOLE), 1, "there is no such run");
        for broken in
            [RingwingCallbacks { size_bytes: 16, ..WHOLE }, RingwingCallbacks { step: None, ..WHOLE }]
        {
            assert_eq!(called(&run, &raw const broken), 2, "{broken:?}");
        }
    }

    #[test]
    fn a_track_goes_on_along_its_arc() {
        let track = RingwingTrack { speed_m_s: 10.0, ..RingwingTrack::default() };
        assert_eq!(ringwing_track_after(track, 2.0).position_m.x, 20.0);
        let turned = ringwing_track_after(RingwingTrack { turn_rate_rad_s: 0.5, ..track }, 2.0);
        assert!((turned.heading_rad - 1.0).abs() < 1e-12, "{turned:?}");
        assert!((turned.position_m.x - 20.0 * 1_f64.sin()).abs() < 1e-9, "{turned:?}");
    }

    #[test]
    fn the_header_is_what_the_generator_makes() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
        let made = cbindgen::generate(folder).unwrap();
        let header = folder.join("include/ringwing.h");
        if std::env::var("SNAPSHOTS").is_ok_and(|action| action == "overwrite") {
            made.write_to_file(header);
            return;
        }
        let mut text = Vec::new();
        made.write(&mut text);
        let committed = std::fs::read(header).unwrap_or_default();
        assert!(
            text == committed,
            "include/ringwing.h differs from the sources: run `SNAPSHOTS=overwrite cargo test --release -p \
             ringwing-controller-c header`, and look at the difference:\n{}",
            String::from_utf8_lossy(&text)
        );
    }
}
