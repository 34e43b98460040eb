-- name: derive.annotated_input
-- kind: macro
-- description: The message that each cache held when an output of an annotation was published: the
--     latest run of the input's callback (by effective end) that ended at or before the cut, or
--     nested inside the publishing run and before the publication. The input whose own run
--     publishes is none of these. Runs that were under way at the cut, on other threads, could
--     have been it as well. Nothing is linked across a gap in the record of either thread.
-- grain: one row per annotation, publication by one of its outputs, and other input with a message
-- param: only_run BIGINT  Run to look at
-- param: wanted_kind VARCHAR  Kind of the annotations
-- needs: derive.annotated_publication, derive.annotated_run, store.annotation_input,
--     store.callback_instance, store.thread_break, derive.exposed_trace,
--     derive.recording_gap
CREATE OR REPLACE MACRO derive.annotated_input(only_run, wanted_kind) AS TABLE
WITH nesting AS (
    SELECT DISTINCT parent_id
    FROM store.callback_instance
    WHERE run_id = only_run AND parent_id IS NOT NULL
),
demand AS MATERIALIZED (
    SELECT
        b.run_id, b.annotation_id, b.publication_id, b.callback_instance_id AS publishing_id,
        b.trace_id, b.thread_id, b.start_ns, b.start_event_id, b.cut_event_id,
        i.subscription_id
    FROM derive.annotated_publication(only_run) AS b
    JOIN store.annotation_input AS i ON b.annotation_id = i.annotation_id
    WHERE b.kind = wanted_kind AND b.subscription_id IS DISTINCT FROM i.subscription_id
),
run AS MATERIALIZED (
    SELECT
        run_id, subscription_id, callback_instance_id, thread_id, start_event_id,
        effective_end_event_id
    FROM derive.annotated_run(only_run)
),
-- Runs that end together (in a gap) are one moment: the last to begin stands for it.
ended AS (
    SELECT
        run_id, subscription_id, effective_end_event_id,
        arg_max(callback_instance_id, start_event_id) AS callback_instance_id
    FROM run
    GROUP BY run_id, subscription_id, effective_end_event_id
),
ended_on_thread AS (
    SELECT
        run_id, thread_id, subscription_id, effective_end_event_id,
        arg_max(callback_instance_id, start_event_id) AS callback_instance_id,
        max(start_event_id) AS start_event_id
    FROM run
    GROUP BY run_id, thread_id, subscription_id, effective_end_event_id
),
nested AS (
    SELECT d.annotation_id, d.publication_id, d.subscription_id, e.callback_instance_id
    FROM (
        SELECT * FROM demand
        WHERE publishing_id IN (
            SELECT parent_id FROM nesting
        )
    ) AS d
    ASOF JOIN ended_on_thread AS e
        ON d.run_id = e.run_id
        AND d.thread_id = e.thread_id
        AND d.subscription_id = e.subscription_id
        AND d.start_event_id >= e.effective_end_event_id
    WHERE e.start_event_id > d.cut_event_id
),
-- Publications of one run share their cut.
cut AS MATERIALIZED (
    SELECT DISTINCT run_id, subscription_id, thread_id, cut_event_id FROM demand
),
-- Where all runs of an input are on the publishing thread, none is under way at the cut unless
-- others are nested in it.
alone AS (
    SELECT run_id, subscription_id, min(thread_id) AS thread_id
    FROM run
    GROUP BY run_id, subscription_id
    HAVING min(thread_id) = max(thread_id)
        AND NOT bool_or(
            callback_instance_id IN (
                SELECT parent_id FROM nesting
            )
        )
),
shared_cut AS MATERIALIZED (
    SELECT c.run_id, c.subscription_id, c.thread_id, c.cut_event_id
    FROM cut AS c
    ANTI JOIN alone AS a
        ON c.run_id = a.run_id
        AND c.subscription_id = a.subscription_id
        AND c.thread_id = a.thread_id
),
step AS (
    SELECT run_id, subscription_id, start_event_id AS event_id, 1 AS change
    FROM run
    WHERE subscription_id IN (SELECT subscription_id FROM shared_cut)
    UNION ALL
    SELECT run_id, subscription_id, effective_end_event_id, -1
    FROM run
    WHERE subscription_id IN (SELECT subscription_id FROM shared_cut)
),
under_way AS (
    SELECT
        run_id, subscription_id, event_id,
        sum(sum(change)) OVER (
            PARTITION BY run_id, subscription_id ORDER BY event_id ROWS UNBOUNDED PRECEDING
        ) AS run_count
    FROM step
    GROUP BY run_id, subscription_id, event_id
),
under_way_at_cut AS (
    SELECT c.subscription_id, c.thread_id, c.cut_event_id, u.run_count
    FROM shared_cut AS c
    ASOF JOIN under_way AS u
        ON c.run_id = u.run_id
        AND c.subscription_id = u.subscription_id
        AND c.cut_event_id >= u.event_id
    WHERE u.run_count > 0
),
at_cut AS (
    SELECT
        c.subscription_id, c.thread_id, c.cut_event_id, e.callback_instance_id,
        coalesce(u.run_count, 0) AS run_count
    FROM cut AS c
    ASOF LEFT JOIN ended AS e
        ON c.run_id = e.run_id
        AND c.subscription_id = e.subscription_id
        AND c.cut_event_id >= e.effective_end_event_id
    LEFT JOIN under_way_at_cut AS u
        ON c.subscription_id = u.subscription_id
        AND c.thread_id = u.thread_id
        AND c.cut_event_id = u.cut_event_id
),
cached AS (
    SELECT
        d.run_id, d.annotation_id, d.publication_id, d.publishing_id, d.subscription_id,
        d.trace_id, d.thread_id, d.start_ns, d.start_event_id,
        coalesce(n.callback_instance_id, c.callback_instance_id) AS callback_instance_id,
        1 + c.run_count AS candidate_count
    FROM demand AS d
    JOIN at_cut AS c
        ON d.subscription_id = c.subscription_id
        AND d.thread_id = c.thread_id
        AND d.cut_event_id = c.cut_event_id
    LEFT JOIN nested AS n
        ON d.annotation_id = n.annotation_id
        AND d.publication_id = n.publication_id
        AND d.subscription_id = n.subscription_id
),
found AS MATERIALIZED (
    SELECT
        c.run_id, c.annotation_id, c.publication_id, c.publishing_id, c.subscription_id,
        c.callback_instance_id, c.candidate_count,
        c.trace_id, c.thread_id, c.start_ns, c.start_event_id,
        i.trace_id AS input_trace_id,
        i.thread_id AS input_thread_id,
        i.start_ns AS input_start_ns,
        i.start_event_id AS input_start_event_id,
        i.effective_end_event_id AS input_end_event_id
    FROM cached AS c
    JOIN store.callback_instance AS i
        ON c.callback_instance_id = i.callback_instance_id AND i.run_id = only_run
),
-- Only traces with gaps need a closer look.
exposed AS MATERIALIZED (
    SELECT
        f.annotation_id, f.publication_id, f.callback_instance_id, f.thread_id,
        f.input_thread_id, f.start_event_id, f.input_start_event_id,
        g.start_ns >= f.input_start_ns AS begins_between
    FROM (
        SELECT n.*, x.recording_id
        FROM found AS n
        JOIN derive.exposed_trace AS x ON n.trace_id = x.trace_id
        UNION
        SELECT n.*, x.recording_id
        FROM found AS n
        JOIN derive.exposed_trace AS x ON n.input_trace_id = x.trace_id
    ) AS f
    ASOF JOIN derive.recording_gap AS g
        ON f.recording_id = g.recording_id AND f.start_ns > g.start_ns
    WHERE g.covered_until_ns >= f.input_start_ns
),
-- What may have been lost on other CPUs is marked.
break AS (
    SELECT thread_id, resumed_event_id
    FROM store.thread_break
    WHERE run_id = only_run AND is_elsewhere IS NOT TRUE
),
crossing AS (
    SELECT e.annotation_id, e.publication_id, e.callback_instance_id
    FROM exposed AS e
    ASOF JOIN break AS k
        ON e.thread_id = k.thread_id AND e.input_start_event_id < k.resumed_event_id
    WHERE k.resumed_event_id <= e.start_event_id
    UNION
    -- The input's thread may be heard of again only after the publication.
    SELECT e.annotation_id, e.publication_id, e.callback_instance_id
    FROM exposed AS e
    ASOF JOIN break AS k
        ON e.input_thread_id = k.thread_id AND e.input_start_event_id < k.resumed_event_id
    WHERE k.resumed_event_id <= e.start_event_id OR e.begins_between
)
SELECT
    f.run_id,
    f.annotation_id,
    f.publication_id,
    f.publishing_id,
    f.subscription_id,
    f.callback_instance_id,
    f.input_end_event_id,
    f.candidate_count::BIGINT AS candidate_count,
    x.publication_id IS NOT NULL AS is_loss_affected
FROM found AS f
LEFT JOIN (SELECT DISTINCT annotation_id, publication_id, callback_instance_id FROM exposed) AS x
    ON f.annotation_id = x.annotation_id
    AND f.publication_id = x.publication_id
    AND f.callback_instance_id = x.callback_instance_id
ANTI JOIN crossing AS k
    ON f.annotation_id = k.annotation_id
    AND f.publication_id = k.publication_id
    AND f.callback_instance_id = k.callback_instance_id
