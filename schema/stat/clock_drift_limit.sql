-- name: derive.clock_drift_limit
-- kind: macro
-- description: How fast two clocks can drift apart, per time elapsed. Quartz runs 100 ppm too fast
--     or too slow at worst, and NTP slews what it corrects: two that differ by more than 200 ppm
--     are not what messages can bring together.
CREATE OR REPLACE MACRO derive.clock_drift_limit() AS 200e-6
