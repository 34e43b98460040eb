-- description: Clocks with the same number are corrected to the same clock, so that their times
--     compare. A clock that is not corrected has a number of its own.
CREATE OR REPLACE MACRO derive.clock_group_id(clock_id, reference_clock_id) AS
    coalesce(reference_clock_id, -clock_id)
