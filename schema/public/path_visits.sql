-- description: Whether a path, as main.flow_path writes it, visits all of some places, and none of
--     others. A path in place of places is that path: others may visit the same in another order.
-- param: path VARCHAR  The path; NULL: true
-- param: via VARCHAR[]  Topics, nodes or services that it visits: globs; NULL: any
-- param: without VARCHAR[]  Those that it does not; NULL: none
CREATE OR REPLACE MACRO main.path_visits(path, via, without) AS
coalesce(list_bool_and(list_transform(
    via::VARCHAR[],
    lambda each: path = each OR list_bool_or(list_transform(
        string_split(path, ' → '),
        lambda step: step = trim(each) OR trim(step, '()') GLOB trim(each)
    ))
)), true)
AND NOT coalesce(list_bool_or(list_transform(
    without::VARCHAR[],
    lambda each: path = each OR list_bool_or(list_transform(
        string_split(path, ' → '),
        lambda step: step = trim(each) OR trim(step, '()') GLOB trim(each)
    ))
)), false)
