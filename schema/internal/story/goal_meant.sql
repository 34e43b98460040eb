-- title: Goals that somebody may mean
-- description: Those that the runs have, the nearest to what was said first.
-- grain: one row per goal
-- param: goal VARCHAR  Identity of a goal, its first digits, or the name of an action
-- column: place INTEGER  0: its identity; 1: begins like that; 2: of this action; 3: another one
-- column: goal_id BIGINT  Its identity
-- column: said VARCHAR  What it is
SELECT
    CASE
        WHEN g.goal_id::VARCHAR = $goal THEN 0
        WHEN starts_with(g.goal_id::VARCHAR, $goal::VARCHAR) THEN 1
        WHEN g.action_name = $goal THEN 2
        ELSE 3
    END AS place,
    g.goal_id,
    printf(
        '%d (%s at %.3f s%s)', g.goal_id, coalesce(g.action_name, '?'),
        (coalesce(g.sent_ns, g.taken_ns) - r.start_ns) / 1e9,
        coalesce(': ' || main.duration_text(g.latency_ns), '')
    ) AS said
FROM main.goal AS g
JOIN main.run AS r ON g.run_id = r.run_id
WHERE list_contains($runs, g.run_id)
ORDER BY place, g.run_id DESC, g.latency_ns DESC NULLS LAST, g.goal_id
