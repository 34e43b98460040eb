-- description: How fast two clocks can drift apart, per time elapsed. Quartz runs at most 100 ppm
--     too fast or too slow, and NTP slews what it corrects. Two clocks that differ by more than
--     200 ppm cannot be brought together by messages.
CREATE OR REPLACE MACRO derive.clock_drift_limit() AS 200e-6
