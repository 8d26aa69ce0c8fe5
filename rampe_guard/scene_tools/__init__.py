"""Scene files made from what a site has already, shown as a model, and compared.

::

    moveit, meshes, cloud_read → cloud → voxels, plan_read → plan → prism
        each gives a `draft.Draft`, which `write` turns into a scene file and meshes beside it
    glb      a scene as a glTF model
    compare  what a new version of a scene protects no more

An importer never leaves out silently what it read: what it cannot hold makes an error, and what
it was told to leave out is counted in the notes.
"""
