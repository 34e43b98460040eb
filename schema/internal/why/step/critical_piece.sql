-- title: The pieces of one flow, from inputs whose moments are known
-- description: The step critical_piece of critical-path.
-- grain: one row per flow and piece
-- reads: critical_part, ready_wait
FROM main.critical_piece(
    'critical_part', $runs, waits := 'ready_wait', has_kernel := $has_kernel,
    has_calls := $has_calls, has_teams := $has_teams
)
