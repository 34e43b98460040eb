-- description: Messages that were kept until another callback published, as annotations tell.
--     `periodic_async`: a publication uses the latest message of each input, whatever was used
--     before; the caches are never emptied. `partial_sync`: publications need a message of every
--     input, and use each once. The firing's own message is a direct link; of every other input the
--     latest counts that came after the caches were last emptied and did not fire itself.
--     What a cache held when an output was published is the latest instance of the input's callback
--     (by effective end) that ended at or before the cut, or nested inside the publishing instance
--     and before the publication. The input whose own instance publishes is left out. The
--     trace does not show when a node reads its caches. So other instances are candidates, too:
--     those that began before the publication, and ended after the instance in the cache at the cut
--     began. A firing needs a message of every input: if there was none at the cut, the last of the
--     candidates counts, and "no message" is one more candidate. On one thread the order of events
--     decides: what ran nested in a firing, before it published last, was used by it and by no
--     other; and what a firing is nested in has not ended. Nothing is linked across a gap in the
--     record of either thread. Messages of rclpy have no callback instance: derive.annotated_run
--     says what stands for it.
-- grain: one row per annotation, publication by one of its outputs, and other input with a message
CREATE OR REPLACE MACRO derive.link_causal_indirect(only_run) AS TABLE
WITH RECURSIVE annotated AS MATERIALIZED (FROM derive.annotated_publication(only_run)),
input_run AS MATERIALIZED (FROM derive.annotated_run(only_run)),
nesting AS (
    SELECT DISTINCT parent_id
    FROM store.callback_instance
    WHERE run_id = only_run AND parent_id IS NOT NULL
),
-- Only of partial_sync: the caches of periodic_async are never emptied.
firing AS MATERIALIZED (
    SELECT
        annotation_id, callback_instance_id, first_event_id, last_event_id, emptied_event_id,
        kept_event_id
    FROM derive.partial_sync_firing('annotated')
),
-- All publications of a firing use the same messages, except for those that come meanwhile, in
-- callback instances nested in the firing.
demand AS MATERIALIZED (
    SELECT
        b.run_id, b.annotation_id, b.kind, b.publication_id,
        b.callback_instance_id AS publishing_id,
        b.trace_id, b.thread_id, b.start_ns, b.start_event_id, b.cut_event_id, i.subscription_id,
        CASE
            WHEN n.parent_id IS NULL THEN coalesce(f.first_event_id, b.start_event_id)
            ELSE b.start_event_id
        END AS read_event_id,
        coalesce(f.emptied_event_id, 0) AS emptied_event_id,
        coalesce(f.kept_event_id, 0) AS kept_event_id
    FROM annotated AS b
    JOIN store.annotation_input AS i ON b.annotation_id = i.annotation_id
    LEFT JOIN firing AS f
        ON b.annotation_id = f.annotation_id AND b.callback_instance_id = f.callback_instance_id
    LEFT JOIN nesting AS n ON b.callback_instance_id = n.parent_id
    WHERE b.subscription_id IS DISTINCT FROM i.subscription_id
        AND (b.kind = 'periodic_async' OR f.annotation_id IS NOT NULL)
),
-- A callback instance that fires is no candidate: its own firing used its message.
run AS MATERIALIZED (
    SELECT
        i.annotation_id, r.subscription_id, r.callback_instance_id, r.thread_id, r.start_event_id,
        r.effective_end_event_id
    FROM store.annotation AS a
    JOIN store.annotation_input AS i ON a.annotation_id = i.annotation_id
    JOIN input_run AS r ON i.subscription_id = r.subscription_id
    ANTI JOIN firing AS f
        ON a.annotation_id = f.annotation_id AND r.callback_instance_id = f.callback_instance_id
    WHERE a.run_id = only_run
),
-- What nested instances of inputs run in, at any depth.
around (callback_instance_id, outer_id) AS (
    SELECT callback_instance_id, parent_id
    FROM store.callback_instance
    WHERE run_id = only_run
        AND parent_id IS NOT NULL
        AND callback_instance_id IN (SELECT callback_instance_id FROM input_run)
    UNION ALL
    SELECT a.callback_instance_id, i.parent_id
    FROM around AS a
    JOIN store.callback_instance AS i ON a.outer_id = i.callback_instance_id
),
used AS (
    SELECT r.annotation_id, r.callback_instance_id
    FROM run AS r
    JOIN around AS a ON r.callback_instance_id = a.callback_instance_id
    JOIN firing AS f ON r.annotation_id = f.annotation_id AND a.outer_id = f.callback_instance_id
    WHERE r.effective_end_event_id <= f.last_event_id
),
-- Candidates beside those in a cache at the cut, or nested in the firing.
free AS MATERIALIZED (
    SELECT
        r.annotation_id, r.subscription_id, r.callback_instance_id, r.start_event_id,
        r.effective_end_event_id
    FROM run AS r
    ANTI JOIN used AS u
        ON r.annotation_id = u.annotation_id AND r.callback_instance_id = u.callback_instance_id
),
free_ended AS (
    SELECT
        annotation_id, subscription_id, effective_end_event_id,
        arg_max(callback_instance_id, start_event_id) AS callback_instance_id,
        sum(count(*)) OVER (
            PARTITION BY annotation_id, subscription_id
            ORDER BY effective_end_event_id ROWS UNBOUNDED PRECEDING
        ) AS run_count
    FROM free
    GROUP BY annotation_id, subscription_id, effective_end_event_id
),
-- Instances that end at the same moment (at a gap) count once: the last to begin stands for all.
ended AS (
    SELECT
        annotation_id, subscription_id, effective_end_event_id,
        arg_max(callback_instance_id, start_event_id) AS callback_instance_id,
        max(start_event_id) AS start_event_id
    FROM run
    GROUP BY annotation_id, subscription_id, effective_end_event_id
),
ended_on_thread AS (
    SELECT
        annotation_id, thread_id, subscription_id, effective_end_event_id,
        arg_max(callback_instance_id, start_event_id) AS callback_instance_id,
        max(start_event_id) AS start_event_id
    FROM run
    GROUP BY annotation_id, thread_id, subscription_id, effective_end_event_id
),
nested AS (
    SELECT d.annotation_id, d.publication_id, d.subscription_id, e.callback_instance_id
    FROM demand AS d
    ASOF JOIN ended_on_thread AS e
        ON d.annotation_id = e.annotation_id
        AND d.thread_id = e.thread_id
        AND d.subscription_id = e.subscription_id
        AND d.read_event_id >= e.effective_end_event_id
    WHERE e.start_event_id > d.cut_event_id
),
-- What was in the cache at the cut. What else may have been used ended after that began.
there AS MATERIALIZED (
    SELECT
        d.*,
        CASE WHEN e.effective_end_event_id > d.emptied_event_id THEN e.callback_instance_id END
            AS callback_instance_id,
        greatest(
            CASE WHEN e.effective_end_event_id > d.emptied_event_id THEN e.start_event_id END,
            d.kept_event_id
        ) AS since_event_id
    FROM demand AS d
    ASOF LEFT JOIN ended AS e
        ON d.annotation_id = e.annotation_id
        AND d.subscription_id = e.subscription_id
        AND d.cut_event_id >= e.effective_end_event_id
),
-- Instances in the order in which they began. Each has the instance that ends last among itself and
-- those before it.
begun AS (
    SELECT
        annotation_id, subscription_id, start_event_id,
        row_number() OVER so_far AS run_count,
        arg_max(callback_instance_id, effective_end_event_id) OVER so_far AS last_id,
        max(effective_end_event_id) OVER so_far AS last_event_id
    FROM free
    WINDOW so_far AS (
        PARTITION BY annotation_id, subscription_id
        ORDER BY start_event_id ROWS UNBOUNDED PRECEDING
    )
),
-- The last to end before the publication, else one that was under way then.
possible AS (
    SELECT
        t.annotation_id, t.publication_id, t.subscription_id,
        CASE
            WHEN e.effective_end_event_id > t.since_event_id THEN e.callback_instance_id
            ELSE b.last_id
        END AS callback_instance_id,
        b.run_count - coalesce(o.run_count, 0) AS run_count
    FROM there AS t
    ASOF JOIN begun AS b
        ON t.annotation_id = b.annotation_id
        AND t.subscription_id = b.subscription_id
        AND t.read_event_id > b.start_event_id
    ASOF LEFT JOIN free_ended AS e
        ON t.annotation_id = e.annotation_id
        AND t.subscription_id = e.subscription_id
        AND t.read_event_id >= e.effective_end_event_id
    ASOF LEFT JOIN free_ended AS o
        ON t.annotation_id = o.annotation_id
        AND t.subscription_id = o.subscription_id
        AND t.since_event_id >= o.effective_end_event_id
    WHERE b.last_event_id > t.since_event_id
),
cached AS (
    SELECT
        d.run_id, d.annotation_id, d.kind, d.publication_id, d.trace_id, d.thread_id, d.start_ns,
        d.start_event_id,
        coalesce(
            n.callback_instance_id, d.callback_instance_id,
            CASE WHEN d.kind = 'partial_sync' AND a.outer_id IS NULL THEN p.callback_instance_id END
        ) AS callback_instance_id,
        CASE
            WHEN d.kind = 'partial_sync' AND n.callback_instance_id IS NOT NULL THEN
                1 + coalesce(p.run_count, (d.callback_instance_id IS NOT NULL)::BIGINT)
            ELSE coalesce(p.run_count, 1) + (d.callback_instance_id IS NULL)::BIGINT
        END AS candidate_count
    FROM there AS d
    LEFT JOIN possible AS p
        ON d.annotation_id = p.annotation_id
        AND d.publication_id = p.publication_id
        AND d.subscription_id = p.subscription_id
    LEFT JOIN nested AS n
        ON d.annotation_id = n.annotation_id
        AND d.publication_id = n.publication_id
        AND d.subscription_id = n.subscription_id
    LEFT JOIN around AS a
        ON d.publishing_id = a.callback_instance_id AND p.callback_instance_id = a.outer_id
),
linked AS (
    FROM cached
    UNION ALL BY NAME
    FROM derive.link_causal_approximate(only_run, 'annotated', 'input_run')
    UNION ALL BY NAME
    FROM derive.link_causal_queue(only_run, 'annotated', 'input_run')
),
-- A message that is missing may have been the right one, since the first that was looked at.
found AS MATERIALIZED (
    SELECT
        c.run_id, c.annotation_id, c.kind, c.publication_id, c.callback_instance_id,
        c.candidate_count, c.trace_id, c.thread_id, c.start_ns, c.start_event_id,
        i.trace_id AS input_trace_id,
        i.thread_id AS input_thread_id,
        i.start_ns AS input_start_ns,
        least(c.since_ns, i.start_ns) AS since_ns,
        i.start_event_id AS input_start_event_id
    FROM linked AS c
    JOIN input_run AS i ON c.callback_instance_id = i.callback_instance_id
),
-- Only traces with gaps need a closer look.
exposed AS MATERIALIZED (
    SELECT
        f.annotation_id, f.publication_id, f.callback_instance_id, f.thread_id,
        f.input_thread_id, f.start_event_id, f.input_start_event_id,
        g.start_ns >= f.input_start_ns AS begins_between
    FROM (
        SELECT
            *,
            unnest([trace_id, input_trace_id]) AS either_trace_id
        FROM found
    ) AS f
    JOIN derive.exposed_trace AS x ON f.either_trace_id = x.trace_id
    ASOF JOIN derive.recording_gap AS g
        ON x.recording_id = g.recording_id AND f.start_ns > g.start_ns
    WHERE g.covered_until_ns >= f.since_ns
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
    -- The next event of the input's thread may come only after the publication.
    SELECT e.annotation_id, e.publication_id, e.callback_instance_id
    FROM exposed AS e
    ASOF JOIN break AS k
        ON e.input_thread_id = k.thread_id AND e.input_start_event_id < k.resumed_event_id
    WHERE k.resumed_event_id <= e.start_event_id OR e.begins_between
)
SELECT
    f.run_id, f.callback_instance_id, f.publication_id, f.kind, f.annotation_id,
    -- What may be missing may have been in the set.
    greatest(
        f.candidate_count,
        CASE WHEN f.kind = 'approximate_sync' AND x.publication_id IS NOT NULL THEN 2 END
    )::BIGINT AS candidate_count,
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
