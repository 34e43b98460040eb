-- description: Stacks that samples saw, below their node and callback, with how often: as tools for
--     flame graphs read them, the outermost call first.
-- grain: one row per node, callback and stack
-- param: instances BIGINT[] = NULL  Only samples of these callback instances
WITH sample AS (
    SELECT
        s.stack_id, i.callback_id,
        CASE WHEN i.callback_id IS NULL THEN s.process_id END
            AS process_id,
        count(*) AS samples
    FROM main.stack_sample AS s
    LEFT JOIN main.callback_instance AS i ON s.callback_instance_id = i.callback_instance_id
    WHERE s.run_id = $run_id
        AND CASE WHEN $instances IS NULL THEN s.at_ns >= $start_ns AND s.at_ns < $end_ns
            ELSE s.callback_instance_id IN (SELECT unnest($instances::BIGINT[])) END
    GROUP BY ALL
),
stack AS (
    SELECT
        c.stack_id,
        list(f.function ORDER BY c.position) AS functions
    FROM main.stack_call AS c
    JOIN main.stack_frame AS f ON c.stack_frame_id = f.stack_frame_id
    WHERE c.run_id = $run_id
    GROUP BY c.stack_id
),
named AS (
    SELECT
        [
            coalesce(l.node, main.node_label(NULL, p.name, p.pid)),
            coalesce(l.label, 'outside of callbacks')
        ] || k.functions AS steps,
        s.samples
    FROM sample AS s
    JOIN stack AS k ON s.stack_id = k.stack_id
    LEFT JOIN main.callback_label AS l ON s.callback_id = l.callback_id
    LEFT JOIN main.process AS p ON s.process_id = p.process_id
)
SELECT
    -- A semicolon or the end of a line in a name would divide it; a terminal obeys other controls.
    array_to_string(
        list_transform(
            steps,
            lambda step: regexp_replace(replace(step, ';', ':'), '[\s[:cntrl:]]', ' ', 'g')
        ),
        ';'
    ) AS stack,
    sum(samples)::BIGINT AS samples
FROM named
GROUP BY stack
ORDER BY stack
