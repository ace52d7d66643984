<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<!-- What is known of the catchment of each cell: sums of flags. -->
<qgis version="3.22.0" styleCategories="Symbology">
  <pipe>
    <provider>
      <resampling enabled="true" zoomedInResamplingMethod="nearestNeighbour" zoomedOutResamplingMethod="nearestNeighbour" maxOversampling="2"/>
    </provider>
    <rasterrenderer type="paletted" band="1" opacity="1" alphaBand="-1" nodataColor="">
      <rasterTransparency/>
      <colorPalette>
        <paletteEntry value="0" label="whole catchment, as surveyed" color="#d6ead6" alpha="255"/>
        <paletteEntry value="1" label="touches edge or void" color="#fac460" alpha="255"/>
        <paletteEntry value="2" label="holds filled cells" color="#de82be" alpha="255"/>
        <paletteEntry value="3" label="edge or void; filled cells" color="#cc4c5e" alpha="255"/>
        <paletteEntry value="4" label="depressions changed" color="#9ec4e6" alpha="255"/>
        <paletteEntry value="5" label="edge or void; depressions changed" color="#b0945c" alpha="255"/>
        <paletteEntry value="6" label="filled cells; depressions changed" color="#8468b4" alpha="255"/>
        <paletteEntry value="7" label="all three" color="#5c343c" alpha="255"/>
      </colorPalette>
    </rasterrenderer>
    <brightnesscontrast brightness="0" contrast="0" gamma="1"/>
    <huesaturation saturation="0" grayscaleMode="0" colorizeOn="0"/>
    <rasterresampler maxOversampling="2"/>
    <resamplingStage>provider</resamplingStage>
  </pipe>
  <blendMode>0</blendMode>
</qgis>
