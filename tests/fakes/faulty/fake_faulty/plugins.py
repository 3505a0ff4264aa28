"""The plugins, each with one component or profile that is at fault."""

from __future__ import annotations

from fake_faulty.hooks import Hooks

sound = Hooks(
    cameras="Ramp",
    lights="Lights",
    drivers="Box",
    calibrations="Linear",
    estimators="Mean",
    profiles="sound_profile",
)

mutable_options = Hooks(cameras="Mutable")
lenient_options = Hooks(cameras="Unforbidding")
undocumented_options = Hooks(cameras="Undocumented")
nested_options = Hooks(cameras="Nested")
hasty = Hooks(cameras="Hasty")
demanding = Hooks(cameras="Demanding")
absent = Hooks(cameras="Absent")
opens_once = Hooks(cameras="OpensOnce")
closes_once = Hooks(cameras="ClosesOnce")
forgets_half = Hooks(cameras="ForgetsHalf")
deletes_unset = Hooks(cameras="DeletesUnset")
leaks_thread = Hooks(cameras="LeaksThread")
leaks_file = Hooks(cameras="LeaksFile")
floats = Hooks(cameras="Floats")
four_channels = Hooks(cameras="FourChannels")
no_image = Hooks(cameras="NoImage")
one_buffer = Hooks(cameras="OneBuffer")
clock_backwards = Hooks(cameras="ClockBackwards")
uncounted = Hooks(cameras="Uncounted")
reads_closed = Hooks(cameras="ReadsClosed")
impatient = Hooks(cameras="Impatient")
ends_early = Hooks(cameras="EndsEarly")
waits = Hooks(cameras="Waits")
misarmed = Hooks(cameras="Misarmed")
waits_when_stalled = Hooks(cameras="WaitsWhenStalled")

same_channels = Hooks(lights="SameChannels")
uncovered = Hooks(lights="Uncovered")
too_bright = Hooks(lights="TooBright")
unlit = Hooks(lights="Unlit")
unsteady = Hooks(lights="Unsteady")
endless = Hooks(lights="Endless")
same_lights = Hooks(lights="SameLights")
missing_light = Hooks(lights="Missing")
holding = Hooks(lights="Holding")

disobedient = Hooks(drivers="Disobedient", profiles="driven")
unguarded = Hooks(drivers="Unguarded")
stays_lit = Hooks(drivers="StaysLit")
stays_busy = Hooks(drivers="StaysBusy")

unfittable = Hooks(calibrations="Unfittable")
unseeded = Hooks(calibrations="Unseeded")
doubles = Hooks(calibrations="Doubles")
gaps = Hooks(calibrations="Gaps")
dented = Hooks(calibrations="Dented")
exchanged = Hooks(calibrations="Exchanged")
degrees = Hooks(calibrations="Degrees")
tilted = Hooks(calibrations="Tilted")
rounded = Hooks(calibrations="Rounded")
loads_nothing = Hooks(calibrations="LoadsNothing")
any_size = Hooks(calibrations="AnySize")
changes_frame = Hooks(calibrations="ChangesFrame")
locked_model = Hooks(calibrations="Locked")

unannotated = Hooks(estimators="Unannotated")
needs_unknown = Hooks(estimators="NeedsUnknown")
double_precision = Hooks(estimators="DoublePrecision")
half_size = Hooks(estimators="HalfSize")
writable = Hooks(estimators="Writable")
other_type = Hooks(estimators="OtherType")
timeless = Hooks(estimators="Timeless")
in_place = Hooks(estimators="InPlace")
in_pixels = Hooks(estimators="InPixels")
in_metres = Hooks(estimators="InMetres")
upside_down = Hooks(estimators="UpsideDown")
not_json = Hooks(estimators="NotJson")
random = Hooks(estimators="Random")
never_forgets = Hooks(estimators="NeverForgets")
undeclared = Hooks(estimators="Undeclared")
shared = Hooks(estimators="Shared")
reused_buffer = Hooks(estimators="OneBuffer")
changes_input = Hooks(estimators="ChangesInput")
locked = Hooks(estimators="Locked")
breaks = Hooks(estimators="Breaks")

unknown_key = Hooks(profiles="unknown_key")
unknown_component = Hooks(profiles="unknown_component")
extends_nothing = Hooks(profiles="extends_nothing")
absolute_path = Hooks(profiles="absolute_path")
misnamed = Hooks(profiles="misnamed")
shadowing = Hooks(profiles="shadowing")
unpicklable = Hooks(profiles="unpicklable")
failing = Hooks(profiles="failing")
