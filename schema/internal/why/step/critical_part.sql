-- title: The parts of one flow, from callbacks whose waits are known
-- description: The step critical_part of critical-path.
-- grain: one row per flow and part
-- reads: breakdown_callback, critical_flow, critical_trail
FROM main.end_to_end_piece_explained(
    'critical_flow', 'critical_trail', 'breakdown_callback', $runs, has_turns := $has_turns
)
