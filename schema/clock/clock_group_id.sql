-- name: derive.clock_group_id
-- kind: macro
-- description: Clocks with the same number are together: corrected to the same one, or one clock.
--     What nothing was corrected to, and that was not corrected itself, stands alone.
CREATE OR REPLACE MACRO derive.clock_group_id(clock_id, reference_clock_id) AS
    coalesce(reference_clock_id, -clock_id)
