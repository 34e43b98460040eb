-- description: A time of some clock on the common time axis: its offset, and its drift since the
--     reference. `clock` is a row with the three.
CREATE OR REPLACE MACRO derive.corrected_ns(time_ns, clock) AS
time_ns + clock.offset_ns
+ CASE
    WHEN clock.drift_ppb = 0 THEN 0
    ELSE round((time_ns - clock.reference_ns)::DOUBLE * clock.drift_ppb / 1e9)::BIGINT
END
